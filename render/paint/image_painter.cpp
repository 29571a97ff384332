#include "render/paint/image_painter.hpp"

#include <atomic>
#include <cstring>

namespace afterglow::render {
namespace {

/// The even-odd rule for shares: 0 and 2 are outside, 1 is inside.
float evenOdd(float sum) {
  const float within = std::fmod(std::abs(sum), 2.f);
  return within <= 1 ? within : 2 - within;
}

/// Triangles of a fan that is one polygon if it is flat. Fewer join the segments of lines, which
/// overlap in a corner's pixels: pair by pair the sum of their shares is nearer to the truth.
constexpr std::uint32_t kLeastDisc = 7;
/// The largest disc that is a polygon, all of whose edges each band goes over.
constexpr std::uint32_t kLargestDisc = 192;

/// Writes each pixel's alpha, too, where the next pixel comes: four bytes at once.
void copyColors(const Light* lights, int count, std::uint8_t* out) {
  using Bytes = std::uint8_t __attribute__((vector_size(4)));
  for (int i = 0; i + 1 < count; ++i, out += 3) {
    const Bytes bytes = __builtin_convertvector(lights[i], Bytes);
    std::memcpy(out, &bytes, sizeof(bytes));
  }
  for (int lane = 0; lane < 3; ++lane) *out++ = static_cast<std::uint8_t>(lights[count - 1][lane]);
}

}  // namespace

ImagePainter::ImagePainter(const calib::Lens& lens, Workers& workers)
    : width_(lens.width),
      height_(lens.height),
      bands_((lens.height + kBandRows - 1) / kBandRows),
      lens_(lens),
      workers_(workers),
      benches_(static_cast<std::size_t>(workers.count()), Bench(lens.width)) {}

void ImagePainter::paint(const PaintList& list, const Bands& bands, std::uint8_t* rgb) {
  addJobs(list);
  std::atomic<int> next{0};
  workers_.run([&](int worker) {
    Bench& bench = benches_[static_cast<std::size_t>(worker)];
    for (int band = next++; band < bands_; band = next++) {
      if (bands[static_cast<std::size_t>(band)]) paintBand(list, band, bench, rgb);
    }
  });
}

void ImagePainter::project(PaintList& list) {
  list.vertices.resize(list.steps.triangles.vertices.size());
  workers_.share(list.vertices.size(), [&](int, std::size_t begin, std::size_t end) {
    if (lens_.is_fisheye) {
      projectPart<true>(list, begin, end);
    } else {
      projectPart<false>(list, begin, end);
    }
  });
}

template <bool kFisheye>
void ImagePainter::projectPart(PaintList& list, std::size_t begin, std::size_t end) const {
  for (std::size_t i = begin; i < end; ++i) {
    const LightVertex& vertex = list.steps.triangles.vertices[i];
    const float inverse = 1 / vertex.z;
    list.vertices[i] = {lens_.seen<kFisheye>(vertex.x * inverse, vertex.y * inverse), vertex.depth,
                        packedColor(vertex.color)};
  }
}

/// Far outside is outside; an integer could not hold it. Above zero, cutting off rounds down.
Rows ImagePainter::rowsBetween(float top, float bottom) const {
  const int lift = height_ + kBandRows;
  const auto limit = static_cast<float>(lift);
  const auto rowOf = [&](float y) {
    return static_cast<int>(std::clamp(y, -limit, limit) + limit) - lift;
  };
  return {rowOf(top), rowOf(bottom)};
}

void ImagePainter::mark(const PaintList& list, const StepEnds& from, const StepEnds& to,
                        Bands& bands) const {
  const auto markRows = [&](Rows rows) {
    const int first = std::max(rows.first, 0) / kBandRows;
    const int last = std::min(rows.last, height_ - 1);
    for (int band = first; last >= 0 && band <= last / kBandRows; ++band) {
      bands[static_cast<std::size_t>(band)] = 1;
    }
  };
  for (std::size_t i = from.sprites; i < to.sprites; ++i) {
    const Sprite& sprite = list.steps.sprites.all[i];
    markRows(rowsBetween(sprite.top, sprite.bottom));
  }
  if (from.vertices == to.vertices) return;
  const auto first = list.vertices.begin() + static_cast<std::ptrdiff_t>(from.vertices);
  const auto last = list.vertices.begin() + static_cast<std::ptrdiff_t>(to.vertices);
  const auto [top, bottom] = std::minmax_element(
      first, last, [](const auto& a, const auto& b) { return a.at.y < b.at.y; });
  markRows(rowsBetween(top->at.y, bottom->at.y));
}

void ImagePainter::addJobs(const PaintList& list) {
  jobs_.clear();
  face_bins_.begin(bands_);
  sprite_bins_.begin(bands_);
  point_bins_.begin(bands_);
  bool was_flattened = false;
  for (const ExpandedLayer& layer : list.layers) {
    if (layer.flattened || was_flattened) jobs_.push_back({Job::Kind::Flatten});
    was_flattened = layer.flattened;
    for (const Piece& piece : layer.pieces) {
      Job job{Job::Kind::Triangles};
      job.mask = layer.mask;
      job.is_opaque = piece.is_opaque;
      switch (piece.kind) {
        case Piece::Kind::Points: {
          const PointRun& run = list.runs[piece.first];
          job.kind = Job::Kind::Points;
          job.bins = static_cast<std::uint32_t>(point_bins_.runs());
          job.brush = &brushes_.try_emplace(run.size_px, run.size_px).first->second;
          job.is_ordered = run.is_ordered;
          addPoints(list, run, *job.brush);
          break;
        }
        case Piece::Kind::Outlines:
          job.kind = Job::Kind::Sprites;
          job.bins = static_cast<std::uint32_t>(sprite_bins_.runs());
          addSprites(list.steps.sprites, piece);
          break;
        case Piece::Kind::Triangles:
          job.bins = static_cast<std::uint32_t>(face_bins_.runs());
          addTriangles(list, piece);
          break;
      }
      jobs_.push_back(job);
    }
  }
}

void ImagePainter::addPoints(const PaintList& list, const PointRun& run,
                             const PointBrush& brush) {
  const ScreenPoint* points = list.screen_points.data() + run.first;
  point_bins_.add(
      run.count, workers_, [&](std::size_t i) { return brush.rows(points[i]); },
      [&](std::size_t i) { return points[i]; });
}

void ImagePainter::addSprites(const Sprites& sprites, const Piece& piece) {
  const auto rowsOf = [&](std::size_t i) {
    const Sprite& sprite = sprites.all[piece.first + i];
    return rowsBetween(sprite.top, sprite.bottom);
  };
  sprite_bins_.add(piece.count, workers_, rowsOf,
                   [&](std::size_t i) { return static_cast<std::uint32_t>(piece.first + i); });
}

/// Ribbons, boxes, tubes and discs come as fans of triangles: as polygons they are less work. Where
/// a fan is not flat, or short, two triangles are taken together.
void ImagePainter::findFaces(const PaintList& list, const Piece& piece) {
  faces_.clear();
  const std::uint32_t end = piece.first + piece.count;
  const std::uint32_t* indices = list.steps.triangles.indices.data();
  for (std::uint32_t i = piece.first; i < end;) {
    const std::uint32_t length = fanLength(list, indices + i, indices + end);
    Face face{i, length};
    if (!isDisc(list, face)) face.triangles = std::min(length, 2u);
    for (; face.first < i + 3 * length; face.first += 3 * face.triangles) {
      face.triangles = std::min(face.triangles, length - (face.first - i) / 3);
      faces_.push_back(face);
    }
    i += 3 * length;
  }
}

bool ImagePainter::isDisc(const PaintList& list, const Face& fan) {
  if (fan.triangles < kLeastDisc) return false;
  setPolygon(list, fan, fan_);
  return PolygonBrush::isFlat(fan_);
}

/// Returns how many triangles have the first's first corner and its color, each next to the one
/// before it and turning the same way.
std::uint32_t ImagePainter::fanLength(const PaintList& list, const std::uint32_t* first,
                                      const std::uint32_t* end) const {
  const std::vector<ScreenVertex>& vertices = list.vertices;
  const auto turnsRight = [&](const std::uint32_t* at) {
    const Corner &a = vertices[at[0]].at, &b = vertices[at[1]].at, &c = vertices[at[2]].at;
    return (b.x - a.x) * (c.y - a.y) > (b.y - a.y) * (c.x - a.x);
  };
  const auto color = [&](const std::uint32_t* at) { return vertices[*at].color; };
  if (color(first) != color(first + 1) || color(first) != color(first + 2)) return 1;
  const bool turn = turnsRight(first);
  const std::uint32_t* next = first + 3;
  end = first + std::min(end - first, std::ptrdiff_t{3} * kLargestDisc);
  while (next < end && next[0] == *first && next[1] == next[-1] &&
         color(next + 2) == color(first) && turnsRight(next) == turn) {
    next += 3;
  }
  return static_cast<std::uint32_t>(next - first) / 3;
}

void ImagePainter::setPolygon(const PaintList& list, const Face& face, ScreenPolygon& out) const {
  const std::uint32_t* at = &list.steps.triangles.indices[face.first];
  out.assign({list.vertices[at[0]], list.vertices[at[1]]});
  for (std::uint32_t i = 0; i < face.triangles; ++i) out.push_back(list.vertices[at[3 * i + 2]]);
}

void ImagePainter::addTriangles(const PaintList& list, const Piece& piece) {
  findFaces(list, piece);
  const auto rowsOfFace = [&](std::size_t i) {
    const std::uint32_t* at = &list.steps.triangles.indices[faces_[i].first];
    auto [top, bottom] = std::minmax({list.vertices[at[0]].at.y, list.vertices[at[1]].at.y});
    for (std::uint32_t k = 0; k < faces_[i].triangles; ++k) {
      top = std::min(top, list.vertices[at[3 * k + 2]].at.y);
      bottom = std::max(bottom, list.vertices[at[3 * k + 2]].at.y);
    }
    return rowsBetween(top, bottom);
  };
  face_bins_.add(faces_.size(), workers_, rowsOfFace, [&](std::size_t i) { return faces_[i]; });
}

ScreenTriangle ImagePainter::triangle(const PaintList& list, std::uint32_t first) const {
  const std::uint32_t* at = &list.steps.triangles.indices[first];
  return {list.vertices[at[0]], list.vertices[at[1]], list.vertices[at[2]]};
}

void ImagePainter::paintBand(const PaintList& list, int band, Bench& bench,
                             std::uint8_t* rgb) const {
  const int row_begin = band * kBandRows, row_end = std::min(height_, row_begin + kBandRows);
  bench.canvas.clear();
  bench.mask_index = -1;
  for (const Job& job : jobs_) {
    switch (job.kind) {
      case Job::Kind::Flatten:
        bench.canvas.flatten();
        break;
      case Job::Kind::Points:
        if (point_bins_.bin(job.bins, band).count == 0) break;
        paintPoints(job, band, maskOf(list, job, band, bench), bench);
        break;
      case Job::Kind::Triangles:
        if (face_bins_.bin(job.bins, band).count == 0) break;
        paintSolid(list, job, band, maskOf(list, job, band, bench), bench);
        break;
      case Job::Kind::Sprites:
        if (sprite_bins_.bin(job.bins, band).count == 0) break;
        paintSolid(list, job, band, maskOf(list, job, band, bench), bench);
        break;
    }
  }
  for (int row = row_begin; row < row_end; ++row) {
    const Light* lights = bench.canvas.finish(row - row_begin);
    copyColors(lights, width_,
               rgb + 3 * static_cast<std::size_t>(row) * static_cast<std::size_t>(width_));
  }
}

void ImagePainter::paintPoints(const Job& job, int band, const std::uint16_t* mask,
                               Bench& bench) const {
  const int row_begin = band * kBandRows, row_end = std::min(height_, row_begin + kBandRows);
  const auto& bin = point_bins_.bin(job.bins, band);
  const ScreenPoint* points = point_bins_.items(bin);
  if (job.is_ordered) points = sortByOrder(points, bin.count, bench.sorting);
  job.brush->paint(points, bin.count, row_begin, row_end, width_, mask, bench.canvas);
}

/// Translucent things are painted by themselves first: each pixel takes its nearest surface.
void ImagePainter::paintSolid(const PaintList& list, const Job& job, int band,
                              const std::uint16_t* mask, Bench& bench) const {
  const int row_begin = band * kBandRows, row_end = std::min(height_, row_begin + kBandRows);
  Canvas& canvas = job.is_opaque ? bench.canvas : bench.glass;
  if (job.kind == Job::Kind::Sprites) {
    const auto& bin = sprite_bins_.bin(job.bins, band);
    const std::uint32_t* items = sprite_bins_.items(bin);
    for (std::size_t i = 0; i < bin.count; ++i) {
      const Sprite& sprite = list.steps.sprites.all[items[i]];
      bench.brush.paint(sprite, &list.steps.sprites.corners[sprite.first], row_begin, row_end, mask,
                        canvas);
    }
  } else {
    const auto& bin = face_bins_.bin(job.bins, band);
    const Face* faces = face_bins_.items(bin);
    for (std::size_t i = 0; i < bin.count; ++i) {
      paintFace(list, faces[i], row_begin, row_end, mask, bench, canvas);
    }
  }
  if (!job.is_opaque) bench.canvas.lay(bench.glass);
}

void ImagePainter::paintFace(const PaintList& list, const Face& face, int row_begin, int row_end,
                             const std::uint16_t* mask, Bench& bench, Canvas& canvas) const {
  if (face.triangles == 1) {
    bench.brush.paint(triangle(list, face.first), row_begin, row_end, mask, canvas);
    return;
  }
  setPolygon(list, face, bench.polygon);
  bench.brush.paint(bench.polygon, row_begin, row_end, mask, canvas);
}

/// Outlines are few and made of few triangles: they need no bins.
const std::uint16_t* ImagePainter::maskOf(const PaintList& list, const Job& job, int band,
                                          Bench& bench) const {
  if (job.mask < 0) return nullptr;
  if (bench.mask_index == job.mask) return bench.mask.data();
  bench.mask_index = job.mask;
  const int row_begin = band * kBandRows, row_end = std::min(height_, row_begin + kBandRows);
  const LightMask& mask = list.steps.triangles.masks[static_cast<std::size_t>(job.mask)];
  std::fill(bench.mask.begin(), bench.mask.end(), static_cast<std::uint16_t>(kWhole));
  const auto multiply = [&](const LightOutline& outline, bool inside) {
    std::fill(bench.mask_sums.begin(), bench.mask_sums.end(), 0.f);
    for (std::uint32_t i = 0; i < outline.count; i += 3) {
      bench.brush.add(triangle(list, outline.first + i), row_begin, row_end,
                      bench.mask_sums.data());
    }
    for (std::size_t i = 0; i < bench.mask.size(); ++i) {
      const float share = evenOdd(bench.mask_sums[i]);
      bench.mask[i] = static_cast<std::uint16_t>(
          static_cast<float>(bench.mask[i]) * (inside ? share : 1 - share) + 0.5f);
    }
  };
  if (mask.outline) multiply(*mask.outline, true);
  for (const LightOutline& shade : mask.shades) multiply(shade, false);
  return bench.mask.data();
}

}  // namespace afterglow::render
