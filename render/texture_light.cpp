#include "render/texture_light.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "render/scene/triangulate.hpp"

#if defined(__x86_64__)
#include <emmintrin.h>
#endif

namespace afterglow::render {
namespace {

constexpr int kBlock = 16;  // px; within it the lens bends rays by less than is seen
constexpr int kLights = 4096;
constexpr float kTolerance = 0.01F;  // of full light: what is cut off by less is not told
constexpr double kFarthest = 1000;   // m
constexpr double kLeastDeterminant = 1e-6;

/// The light for a color at a cell, as it is looked up for every pixel: scale * rows * (color,
/// offset), a quarter of a cache line.
struct alignas(16) Cell {
  std::int8_t rows[3][4];
  float scale;  ///< 0: not known
};

/// Cells lie in squares of this side, each as large as a page of memory: a picture's rows run over
/// a surface in any direction.
constexpr int kTileBits = 4, kTile = 1 << kTileBits;

/// The place of a cell in memory, `tiles` squares being in a row of them.
inline int tiledIndex(int column, int row, int tiles) {
  const int tile = (row >> kTileBits) * tiles + (column >> kTileBits);
  return (tile << (2 * kTileBits)) + ((row & (kTile - 1)) << kTileBits) + (column & (kTile - 1));
}

/// A color as its light, 15 bits a channel, and a constant beside: four numbers of 16 bits.
using ColorLight = std::uint64_t;

struct LightOfCell {
  Eigen::Matrix3d M_light_seen = Eigen::Matrix3d::Zero();
  Eigen::Vector3d in_dark = Eigen::Vector3d::Zero();
};

std::optional<LightOfCell> lightOf(const calib::TextureCell& cell) {
  if (!cell.isKnown()) return std::nullopt;
  const Eigen::Matrix3d M = cell.M_seen_light.cast<double>();
  if (!(std::abs(M.determinant()) > kLeastDeterminant * M.colwise().norm().prod())) {
    return std::nullopt;
  }
  const Eigen::Matrix3d inverse = M.inverse();
  return LightOfCell{inverse, inverse * cell.dark.cast<double>()};
}

/// `offset`: the light that the fourth number of a row means where the others' is 1.
Cell packed(const std::optional<LightOfCell>& light, double offset) {
  Cell cell{};
  if (!light) return cell;
  const double scale = light->M_light_seen.cwiseAbs().maxCoeff() / 127;
  cell.scale = static_cast<float>(scale);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      cell.rows[i][j] = static_cast<std::int8_t>(std::lround(light->M_light_seen(i, j) / scale));
    }
    const double dark = offset > 0 ? -light->in_dark[i] / (scale * offset) : 0;
    cell.rows[i][3] = static_cast<std::int8_t>(std::lround(std::clamp(dark, -127.0, 127.0)));
  }
  return cell;
}

/// A light's place in the table of values to send, channel by channel; some are out of reach.
struct LightIndex {
  std::array<int, 3> at;
  bool is_clipped;
};

inline LightIndex lightIndex(const Cell& cell, ColorLight color, float strength) {
  constexpr float kMost = kLights - 1, kOver = kTolerance * kMost;
  LightIndex index;
#if defined(__x86_64__)
  const __m128i four = _mm_cvtsi64_si128(static_cast<long long>(color));
  const __m128i eight = _mm_unpacklo_epi64(four, four);
  const __m128i bytes = _mm_load_si128(reinterpret_cast<const __m128i*>(&cell));
  const __m128i rows_01 = _mm_srai_epi16(_mm_unpacklo_epi8(bytes, bytes), 8);
  const __m128i row_2 = _mm_srai_epi16(_mm_unpackhi_epi8(bytes, bytes), 8);
  const __m128i halves_01 = _mm_madd_epi16(rows_01, eight), halves_2 = _mm_madd_epi16(row_2, four);
  // (a0 + a1, b0 + b1, c0 + c1, 0)
  const __m128 x = _mm_castsi128_ps(halves_01), y = _mm_castsi128_ps(halves_2);
  const __m128i even = _mm_castps_si128(_mm_shuffle_ps(x, y, _MM_SHUFFLE(2, 0, 2, 0)));
  const __m128i odd = _mm_castps_si128(_mm_shuffle_ps(x, y, _MM_SHUFFLE(3, 1, 3, 1)));
  const __m128 light =
      _mm_mul_ps(_mm_cvtepi32_ps(_mm_add_epi32(even, odd)), _mm_set1_ps(cell.scale * strength));
  const __m128 over = _mm_cmpgt_ps(light, _mm_set1_ps(kMost + kOver));
  const __m128 under = _mm_cmplt_ps(light, _mm_set1_ps(-kOver));
  index.is_clipped = (_mm_movemask_ps(_mm_or_ps(over, under)) & 7) != 0;
  const __m128 within = _mm_min_ps(_mm_max_ps(light, _mm_setzero_ps()), _mm_set1_ps(kMost));
  const __m128i at = _mm_cvtps_epi32(within);
  // Twelve bits each: a lane's lower half holds it.
  index.at = {_mm_extract_epi16(at, 0), _mm_extract_epi16(at, 2), _mm_extract_epi16(at, 4)};
#else
  index.is_clipped = false;
  for (int i = 0; i < 3; ++i) {
    int sum = 0;
    for (int j = 0; j < 4; ++j) {
      sum += cell.rows[i][j] * static_cast<std::int16_t>(color >> (16 * j));
    }
    const float light = static_cast<float>(sum) * (cell.scale * strength);
    if (light > kMost + kOver || light < -kOver) index.is_clipped = true;
    index.at[static_cast<std::size_t>(i)] =
        static_cast<int>(std::nearbyint(std::clamp(light, 0.F, kMost)));
  }
#endif
  return index;
}

bool isBlack(const std::uint8_t* pixel) { return (pixel[0] | pixel[1] | pixel[2]) == 0; }

enum class Overlap { None, Partly, Whole };

/// Returns true if an edge runs through the box.
bool meets(const Eigen::AlignedBox2d& box, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  double begin = 0, end = 1;
  for (int i = 0; i < 2; ++i) {
    const double way = to[i] - from[i];
    const double a = (box.min()[i] - from[i]) / way, b = (box.max()[i] - from[i]) / way;
    if (way == 0) {
      if (from[i] < box.min()[i] || from[i] > box.max()[i]) return false;
      continue;
    }
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return begin <= end;
}

std::vector<int> cornersAlong(int size) {
  std::vector<int> corners;
  for (int at = 0; at < size; at += kBlock) corners.push_back(at);
  corners.push_back(size);
  return corners;
}

}  // namespace

std::string textureWords(const TextureReport& report) {
  if (report.white <= 0) return "nothing of what is lit was photographed: sent as drawn";
  std::string words =
      fmt::format("white is dimmed to {:.0f} % of what half of the surface could show, to be even",
                  100 * report.of_most);
  const auto share = [&](std::size_t pixels) {
    return 100 * static_cast<double>(pixels) / static_cast<double>(report.lit);
  };
  if (report.clipped > 0) {
    words += fmt::format("; {:.1f} % of its light is out of reach", share(report.clipped));
  }
  if (report.unknown > 0) {
    words += fmt::format("; {:.1f} % falls where it was not photographed", share(report.unknown));
  }
  return words;
}

/// A texture as it is looked up.
struct TextureLight::Texture {
  explicit Texture(const calib::SurfaceTexture& from)
      : surface(from.surface),
        origin(from.origin),
        cell(from.cell),
        density(from.density),
        columns(from.columns),
        rows(from.rows),
        tiles((from.columns + kTile - 1) / kTile) {
    for (const calib::TextureCell& known : from.cells) {
      const auto light = lightOf(known);
      if (!light) continue;
      offset = std::max(
          offset, light->in_dark.cwiseAbs().maxCoeff() / light->M_light_seen.cwiseAbs().maxCoeff());
    }
    cells.resize(static_cast<std::size_t>(tiles * ((rows + kTile - 1) / kTile)) * kTile * kTile);
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        cells[static_cast<std::size_t>(tiledIndex(column, row, tiles))] =
            packed(lightOf(from.at(column, row)), offset);
      }
    }
    mean = packed(lightOf(from.mean()), offset);
    const auto values = from.color.valuesToSend(kLights);
    for (std::size_t i = 0; i < 3; ++i) std::copy_n(values[i].begin(), kLights, sent[i].begin());
  }

  /// The cell at a place; nullptr: it was not photographed.
  const Cell* at(float u, float v) const {
    const bool is_within =
        u >= 0 && v >= 0 && u < static_cast<float>(columns) && v < static_cast<float>(rows);
    if (!is_within) return nullptr;
    const Cell& found = cells[static_cast<std::size_t>(
        tiledIndex(static_cast<int>(u), static_cast<int>(v), tiles))];
    return found.scale > 0 ? &found : nullptr;
  }

  std::string surface;
  Eigen::Vector2d origin;
  double cell, density;
  int columns, rows;
  int tiles;          ///< in a row
  double offset = 0;  ///< camera's light that a row's fourth number stands for
  std::vector<Cell> cells;  ///< cells by tiledIndex()
  Cell mean{};
  std::array<std::array<std::uint8_t, kLights>, 3> sent{};
};

/// A surface as an image sees it. Of a ray (x, y, 1): U / W and V / W are the place, in cells of
/// its texture, or meters, 1 / W the depth.
struct TextureLight::PlacedSurface {
  const Texture* texture = nullptr;
  std::size_t index = 0;  ///< index of the texture
  Eigen::Matrix3f M_place_ray;
  std::vector<Eigen::Vector2d> polygon;  ///< polygon in places; empty: endless
  Eigen::AlignedBox2d box;
  double density = 0;  ///< density of light where depth and magnification are 1
  double white = 0, of_most = 0;
  float strength = 0;  ///< a light's place in the table of values, by a row's sum
  std::array<std::array<ColorLight, 256>, 3> colors{};  ///< parts of a color's light

  /// Returns true if it is known what to send for a color.
  bool isKnown() const { return texture != nullptr && white > 0; }

  /// How much of a box of places lies on the surface: whole if no outline runs through it.
  Overlap overlap(const Eigen::AlignedBox2d& places) const {
    if (polygon.empty()) return Overlap::Whole;
    if (!box.intersects(places)) return Overlap::None;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      if (meets(places, polygon[i], polygon[(i + 1) % polygon.size()])) return Overlap::Partly;
    }
    return isInside(polygon, places.center()) ? Overlap::Whole : Overlap::None;
  }
};

struct alignas(64) TextureLight::Count {
  std::size_t lit = 0, clipped = 0, unknown = 0;
};

/// Sends the pixels [begin, end) of one surface; `place` is the first one's U, V and W of
/// PlacedSurface, `step` the way to the next. What is lit has few colors, side by side, and cells
/// are larger than pixels: the same color on the same cell is looked up once.
void TextureLight::sendPixels(const PlacedSurface& surface, float magnification,
                              std::uint8_t* begin, std::uint8_t* end, const Eigen::Vector3f& place,
                              const Eigen::Vector3f& step, Count& count) {
  // All of it in registers: a pixel might be anything that lies in memory.
  const Texture& texture = *surface.texture;
  const Cell* const cells = texture.cells.data();
  const auto columns = static_cast<float>(texture.columns), rows = static_cast<float>(texture.rows);
  const int tiles = texture.tiles;
  const float strength =
      surface.strength * static_cast<float>(texture.density / surface.density) / magnification;
  float u = place.x(), v = place.y(), w = place.z();
  const float du = step.x(), dv = step.y(), dw = step.z();
  const Cell* last_cell = nullptr;
  ColorLight last_color = 0;
  std::uint8_t red = 0, green = 0, blue = 0;
  bool is_clipped = false;
  std::size_t lit = 0, clipped = 0, unknown = 0;
  for (std::uint8_t* pixel = begin; pixel < end; pixel += 3, u += du, v += dv, w += dw) {
    if (isBlack(pixel)) continue;
    ++lit;
    const float depth = 1 / w, column = u * depth, row = v * depth;
    const bool is_within = column >= 0 && row >= 0 && column < columns && row < rows;
    const Cell* cell =
        is_within ? cells + tiledIndex(static_cast<int>(column), static_cast<int>(row), tiles)
                  : nullptr;
    if (cell == nullptr || cell->scale <= 0) {
      ++unknown;
      cell = &texture.mean;
    }
    const ColorLight color =
        surface.colors[0][pixel[0]] + surface.colors[1][pixel[1]] + surface.colors[2][pixel[2]];
    if (cell != last_cell || color != last_color) {
      const LightIndex index = lightIndex(*cell, color, strength * depth * depth * depth);
      red = texture.sent[0][static_cast<std::size_t>(index.at[0])];
      green = texture.sent[1][static_cast<std::size_t>(index.at[1])];
      blue = texture.sent[2][static_cast<std::size_t>(index.at[2])];
      is_clipped = index.is_clipped;
      last_cell = cell;
      last_color = color;
    }
    clipped += is_clipped ? 1 : 0;
    pixel[0] = red;
    pixel[1] = green;
    pixel[2] = blue;
  }
  count.lit += lit;
  count.clipped += clipped;
  count.unknown += unknown;
}

/// A block of pixels, and the surfaces on its rays, the nearest first.
struct TextureLight::Block {
  struct Candidate {
    const PlacedSurface* surface;
    bool is_whole;  ///< true if all of the block lies within its outline
    float nearness;
  };
  int left = 0, top = 0, right = 0, bottom = 0;
  std::array<Eigen::Vector2f, 4> rays;  ///< rays at left top, right top, left bottom, right bottom
  float magnification = 1;
  std::vector<Candidate> candidates;

  bool isLit(const Image& image) const {
    std::uint8_t any = 0;  // without a way out of the loop: eight or more bytes at a time
    for (int y = top; y < bottom; ++y) {
      const std::uint8_t* const row = pixelOf(image.rgb.data(), image.width, y);
      for (int i = 0; i < 3 * (right - left); ++i) any |= row[i];
    }
    return any != 0;
  }

  /// The block's first pixel of a row.
  template <typename Byte>
  Byte* pixelOf(Byte* image, int width, int y) const {
    return image + 3 * (static_cast<std::ptrdiff_t>(y) * width + left);
  }

  void send(Image& image, const Others& others, std::vector<Count>& counts) const {
    for (int y = top; y < bottom; ++y) {
      std::uint8_t* const begin = pixelOf(image.rgb.data(), image.width, y);
      std::uint8_t* const end = begin + 3 * (right - left);
      if (candidates.empty()) {
        others(begin, end);
      } else if (candidates.front().is_whole) {
        sendRun(*candidates.front().surface, begin, end, y, others, counts);
      } else {
        sendMixed(begin, end, y, others, counts);
      }
    }
  }

 private:
  /// Interpolates the rays' places at a row's left and right end.
  std::pair<Eigen::Vector3f, Eigen::Vector3f> placesOf(const PlacedSurface& surface, int y) const {
    const float down = (static_cast<float>(y - top) + 0.5F) / static_cast<float>(bottom - top);
    const Eigen::Vector2f from = rays[0] + down * (rays[2] - rays[0]),
                          to = rays[1] + down * (rays[3] - rays[1]);
    return {surface.M_place_ray * from.homogeneous(), surface.M_place_ray * to.homogeneous()};
  }

  Eigen::Vector3f placeOf(const PlacedSurface& surface, int x, int y) const {
    const auto [from, to] = placesOf(surface, y);
    const float along = (static_cast<float>(x - left) + 0.5F) / static_cast<float>(right - left);
    return from + along * (to - from);
  }

  /// All of a row's pixels lie on this surface.
  void sendRun(const PlacedSurface& surface, std::uint8_t* begin, std::uint8_t* end, int y,
               const Others& others, std::vector<Count>& counts) const {
    if (!surface.isKnown()) return others(begin, end);
    const auto [from, to] = placesOf(surface, y);
    const Eigen::Vector3f step = (to - from) / static_cast<float>(right - left);
    sendPixels(surface, magnification, begin, end, from + 0.5F * step, step, counts[surface.index]);
  }

  /// An outline runs through the block.
  void sendMixed(std::uint8_t* begin, std::uint8_t* end, int y, const Others& others,
                 std::vector<Count>& counts) const {
    for (std::uint8_t* pixel = begin; pixel < end; pixel += 3) {
      const int x = left + static_cast<int>(pixel - begin) / 3;
      const auto owner =
          std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& candidate) {
            const PlacedSurface& surface = *candidate.surface;
            return candidate.is_whole ||
                   isInside(surface.polygon, placeOf(surface, x, y).hnormalized().cast<double>());
          });
      if (owner != candidates.end() && owner->surface->isKnown()) {
        const PlacedSurface& surface = *owner->surface;
        sendPixels(surface, magnification, pixel, pixel + 3, placeOf(surface, x, y),
                   Eigen::Vector3f::Zero(), counts[surface.index]);
      } else {
        others(pixel, pixel + 3);
      }
    }
  }
};

TextureLight::TextureLight(const calib::Lens& lens,
                           const std::vector<calib::SurfaceTexture>& textures, double brightness)
    : lens_(lens),
      brightness_(brightness),
      columns_(cornersAlong(lens.width)),
      rows_(cornersAlong(lens.height)) {
  for (const calib::SurfaceTexture& texture : textures) {
    textures_.push_back(std::make_unique<Texture>(texture));
    reports_.push_back({});
    reports_.back().surface = texture.surface;
  }
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  for (const int y : rows_) {
    for (const int x : columns_) {
      const auto ray = calib::unproject(lens, {x - 0.5, y - 0.5});
      rays_.push_back(ray ? Eigen::Vector2f(ray->head<2>().cast<float>())
                          : Eigen::Vector2f(kNone, kNone));
      magnifications_.push_back(
          ray ? static_cast<float>(calib::lightDensity(lens, *ray, Eigen::Vector3d::UnitZ()))
              : kNone);
    }
  }
}

TextureLight::~TextureLight() = default;

void TextureLight::place(const std::vector<SurfacePatch>& surfaces,
                         const Rigid<Projector, World>& T_projector_world) {
  placed_.clear();
  for (const SurfacePatch& patch : surfaces) {
    PlacedSurface surface;
    for (std::size_t i = 0; i < textures_.size(); ++i) {
      if (textures_[i]->surface != patch.name) continue;
      surface.texture = textures_[i].get();
      surface.index = i;
    }
    const Eigen::Isometry3d T = (T_projector_world * patch.T_world_surface).matrix();
    const Eigen::Vector3d n = T.linear().col(2);
    const double height = n.dot(T.translation());
    if (!(std::abs(height) > 1e-6)) continue;  // seen edge-on
    const Eigen::Vector2d origin =
        surface.texture ? surface.texture->origin : Eigen::Vector2d(0, 0);
    const double cell = surface.texture ? surface.texture->cell : 1;
    Eigen::Matrix3d M;
    M.row(2) = n / height;
    for (int i = 0; i < 2; ++i) {
      const double start = T.linear().col(i).dot(T.translation()) + origin[i];
      M.row(i) = (T.linear().col(i).transpose() - start * M.row(2)) / cell;
    }
    surface.M_place_ray = M.cast<float>();
    for (const Eigen::Vector2d& corner : patch.polygon) {
      surface.polygon.emplace_back((corner - origin) / cell);
      surface.box.extend(surface.polygon.back());
    }
    if (surface.texture) {
      surface.density = std::abs(height);
      setWhite(surface);
    }
    placed_.push_back(std::move(surface));
  }
}

/// By every second corner of the blocks.
void TextureLight::setWhite(PlacedSurface& surface) const {
  const Texture& texture = *surface.texture;
  std::vector<double> grays;
  for (std::size_t row = 0; row < rows_.size(); row += 2) {
    for (std::size_t column = 0; column < columns_.size(); column += 2) {
      const std::size_t corner = row * columns_.size() + column;
      const Eigen::Vector3f place = surface.M_place_ray * rays_[corner].homogeneous();
      if (!(place.z() * kFarthest > 1)) continue;
      const Cell* const cell = texture.at(place.x() / place.z(), place.y() / place.z());
      if (cell == nullptr) continue;
      const double most =
          surface.density * std::pow(place.z(), 3) * magnifications_[corner] / texture.density;
      Eigen::Matrix3d M_light_seen;
      Eigen::Vector3d in_dark;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) M_light_seen(i, j) = cell->scale * cell->rows[i][j];
        in_dark[i] = -cell->scale * texture.offset * cell->rows[i][3];
      }
      grays.push_back(calib::brightestGray(M_light_seen, in_dark, most));
    }
  }
  surface.white = calib::evenWhite(grays);
  if (!(surface.white > 0)) return;
  const auto middle = grays.begin() + static_cast<std::ptrdiff_t>(grays.size() / 2);
  std::nth_element(grays.begin(), middle, grays.end());
  surface.of_most = surface.white / *middle;
  const double white = brightness_ * surface.white;
  if (!(white > 0)) return;  // no light at all
  // The larger one of white and the dark's offset is 1.
  const double unit = std::max(white, texture.offset);
  constexpr double kOne = 32767;
  const auto lightOf = [&](std::size_t value, double share) {
    const double light = share * calib::lightOfSrgb(static_cast<double>(value) / 255);
    return static_cast<ColorLight>(std::lround(kOne * light));
  };
  const auto constant = static_cast<ColorLight>(std::lround(kOne * texture.offset / unit)) << 48;
  for (std::size_t value = 0; value < 256; ++value) {
    const ColorLight light = lightOf(value, white / unit);
    surface.colors[0][value] = light | constant;
    surface.colors[1][value] = light << 16;
    surface.colors[2][value] = light << 32;
  }
  surface.strength = static_cast<float>(unit / kOne * (kLights - 1));
}

void TextureLight::apply(Image& image, const std::vector<SurfacePatch>& surfaces,
                         const Rigid<Projector, World>& T_projector_world, const Others& others) {
  if (image.width != lens_.width || image.height != lens_.height) {
    throw std::logic_error("an image of another size than the lens");
  }
  place(surfaces, T_projector_world);
  std::vector<std::vector<Count>> counts(static_cast<std::size_t>(workers_.count()),
                                         std::vector<Count>(textures_.size()));
  workers_.run([&](int worker) {
    Block block;
    // Its own memory: two workers that count in one cache line wait for each other.
    std::vector<Count> own(textures_.size());
    const auto first = static_cast<std::size_t>(worker);
    const auto step = static_cast<std::size_t>(workers_.count());
    for (std::size_t row = first; row + 1 < rows_.size(); row += step) {
      sendRow(image, row, block, others, own);
    }
    counts[first] = own;
  });
  for (TextureReport& report : reports_) report = {report.surface};
  for (const PlacedSurface& surface : placed_) {
    if (!surface.texture) continue;
    TextureReport& report = reports_[surface.index];
    report.white = surface.white;
    report.of_most = surface.of_most;
    for (const auto& count : counts) {
      report.lit += count[surface.index].lit;
      report.clipped += count[surface.index].clipped;
      report.unknown += count[surface.index].unknown;
    }
  }
}

void TextureLight::sendRow(Image& image, std::size_t row, Block& block, const Others& others,
                           std::vector<Count>& counts) const {
  block.top = rows_[row];
  block.bottom = rows_[row + 1];
  for (std::size_t column = 0; column + 1 < columns_.size(); ++column) {
    block.left = columns_[column];
    block.right = columns_[column + 1];
    if (!block.isLit(image)) continue;
    const std::size_t corner = row * columns_.size() + column, below = corner + columns_.size();
    block.rays = {rays_[corner], rays_[corner + 1], rays_[below], rays_[below + 1]};
    block.magnification = (magnifications_[corner] + magnifications_[below + 1]) / 2;
    findSurfaces(block);
    block.send(image, others, counts);
  }
}

/// The nearest one first, up to the first that nothing of the block passes.
void TextureLight::findSurfaces(Block& block) const {
  block.candidates.clear();
  for (const PlacedSurface& surface : placed_) {
    Eigen::AlignedBox2d box;
    float nearness = 0;
    bool is_before = true;
    for (const Eigen::Vector2f& ray : block.rays) {
      const Eigen::Vector3f place = surface.M_place_ray * ray.homogeneous();
      is_before = is_before && place.z() * static_cast<float>(kFarthest) > 1;
      nearness += place.z();
      box.extend(place.hnormalized().cast<double>());
    }
    if (!is_before) continue;
    const Overlap overlap = surface.overlap(box);
    if (overlap == Overlap::None) continue;
    block.candidates.push_back({&surface, overlap == Overlap::Whole, nearness});
  }
  std::stable_sort(block.candidates.begin(), block.candidates.end(),
                   [](const auto& a, const auto& b) { return a.nearness > b.nearness; });
  const auto whole = std::find_if(block.candidates.begin(), block.candidates.end(),
                                  [](const auto& candidate) { return candidate.is_whole; });
  if (whole != block.candidates.end()) block.candidates.erase(whole + 1, block.candidates.end());
}

}  // namespace afterglow::render
