#include "render/texture_light.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "render/paint/vector_clones.hpp"
#include "render/scene/triangulate.hpp"

namespace afterglow::render {
namespace {

constexpr int kBlock = 16;  // px; within it the lens bends rays by less than is seen
constexpr int kPixels = kBlock * kBlock;
constexpr int kLights = 4096;
constexpr float kTolerance = 0.01F;  // of full light: what is cut off by less is not told
constexpr double kFarthest = 1000;   // m
constexpr double kLeastDeterminant = 1e-6;

/// The light for a color at a cell, as it is looked up for every pixel: |scale| * rows * (color,
/// the texture's offset), a quarter of a cache line.
struct alignas(16) Cell {
  std::int8_t rows[3][4];
  float scale;  ///< below 0: not photographed, the mean of what was; 0: nothing was
};

/// Cells lie in squares of this side, each as large as a page of memory: a picture's rows run over
/// a surface in any direction.
constexpr int kTileBits = 4, kTile = 1 << kTileBits;

/// The place of a cell in memory, `tiles` squares being in a row of them.
inline int tiledIndex(int column, int row, int tiles) {
  const int tile = (row >> kTileBits) * tiles + (column >> kTileBits);
  return (tile << (2 * kTileBits)) + ((row & (kTile - 1)) << kTileBits) + (column & (kTile - 1));
}

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

/// Numbers for red, green and blue; the last one means nothing.
using Channels = float __attribute__((vector_size(16)));
using ChannelInts = std::int32_t __attribute__((vector_size(16)));

/// A cell's rows, each a channel's four bytes, times one column's part of the light.
AFTERGLOW_ALWAYS_INLINE void addColumn(const ChannelInts& rows, int column, float part,
                                       Channels& sum) {
  sum += __builtin_convertvector(rows << (24 - 8 * column) >> 24, Channels) * part;
}

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
    Cell unknown = packed(lightOf(from.mean()), offset);
    unknown.scale = -unknown.scale;
    const int tile_rows = (rows + kTile - 1) / kTile;
    cells.assign(static_cast<std::size_t>(tiles * tile_rows) * kTile * kTile + 1, unknown);
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const auto light = lightOf(from.at(column, row));
        if (!light) continue;
        cells[static_cast<std::size_t>(tiledIndex(column, row, tiles))] = packed(light, offset);
      }
    }
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
  std::vector<Cell> cells;  ///< cells by tiledIndex(); the last one: a place outside
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
  std::array<std::array<float, 256>, 3> lights{};  ///< camera's light that values ask for

  bool isSamePlace(const PlacedSurface& other) const {
    return texture == other.texture && M_place_ray == other.M_place_ray &&
           polygon == other.polygon && density == other.density;
  }

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

struct TextureLight::Count {
  int lit = 0, clipped = 0, unknown = 0;
};

/// A block of pixels, and the surfaces on its rays, the nearest first. Pixels of it are counted row
/// by row, each of kBlock.
struct TextureLight::Block {
  struct Candidate {
    const PlacedSurface* surface;
    bool is_whole;  ///< true if all of the block lies within its outline
    float nearness;
  };
  struct Pixels {
    std::array<std::uint8_t, kPixels> at;
    int count = 0;
    void add(int pixel) {
      at[static_cast<std::size_t>(count++)] = static_cast<std::uint8_t>(pixel);
    }
  };
  int left = 0, top = 0, right = 0, bottom = 0;
  std::ptrdiff_t stride = 0;            ///< bytes from row to row of an image
  std::array<Eigen::Vector2f, 4> rays;  ///< rays at left top, right top, left bottom, right bottom
  float magnification = 1;
  std::vector<Candidate> candidates;
  std::array<std::int32_t, kPixels> cells;  ///< the pixels' indices in a texture's cells
  std::array<float, kPixels> gains;  ///< light by the cell's, as places in the table of values

  /// The block's first pixel of a row.
  template <typename Byte>
  Byte* row(Byte* image, int y) const {
    return image + (top + y) * stride + 3 * left;
  }
  int rows() const { return bottom - top; }
  std::size_t rowBytes() const { return 3 * static_cast<std::size_t>(right - left); }

  bool isLit(const Image& image) const {
    std::uint8_t any = 0;  // without a way out of the loop: eight or more bytes at a time
    for (int y = 0; y < rows(); ++y) {
      const std::uint8_t* const bytes = row(image.rgb.data(), y);
      for (std::size_t i = 0; i < rowBytes(); ++i) any |= bytes[i];
    }
    return any != 0;
  }
  bool isSame(const Image& a, const Image& b) const {
    for (int y = 0; y < rows(); ++y) {
      if (std::memcmp(row(a.rgb.data(), y), row(b.rgb.data(), y), rowBytes()) != 0) return false;
    }
    return true;
  }
  void copy(const Image& from, Image& to) const {
    for (int y = 0; y < rows(); ++y) {
      std::memcpy(row(to.rgb.data(), y), row(from.rgb.data(), y), rowBytes());
    }
  }

  void send(Image& image, const Others& others, Count* counts) {
    if (candidates.empty() || (candidates[0].is_whole && !candidates[0].surface->isKnown())) {
      for (int y = 0; y < rows(); ++y) {
        std::uint8_t* const begin = row(image.rgb.data(), y);
        others(begin, begin + rowBytes());
      }
      return;
    }
    std::uint8_t* const first = row(image.rgb.data(), 0);
    Pixels lit = litPixels(first);
    for (const Candidate& candidate : candidates) {
      const PlacedSurface& surface = *candidate.surface;
      const Pixels own = candidate.is_whole ? std::exchange(lit, {}) : takeInside(surface, lit);
      if (!surface.isKnown()) {
        sendOthers(own, first, others);
        continue;
      }
      findCells(surface);
      sendPixels(surface, own, first, counts[surface.index]);
    }
    sendOthers(lit, first, others);
  }

 private:
  /// Places of a row's pixels, U, V and W of PlacedSurface: the left end's, and from pixel to
  /// pixel.
  struct RowPlaces {
    Eigen::Vector3f begin, step;
    Eigen::Vector3f at(int x) const { return begin + (static_cast<float>(x) + 0.5F) * step; }
  };
  /// Interpolates between the corners.
  class Places {
   public:
    Places(const PlacedSurface& surface, const Block& block)
        : rows_(static_cast<float>(block.rows())),
          columns_(static_cast<float>(block.right - block.left)) {
      for (std::size_t i = 0; i < 4; ++i) {
        corners_[i] = surface.M_place_ray * block.rays[i].homogeneous();
      }
    }
    RowPlaces row(int y) const {
      const float down = (static_cast<float>(y) + 0.5F) / rows_;
      const Eigen::Vector3f from = corners_[0] + down * (corners_[2] - corners_[0]),
                            to = corners_[1] + down * (corners_[3] - corners_[1]);
      return {from, (to - from) / columns_};
    }

   private:
    float rows_, columns_;
    std::array<Eigen::Vector3f, 4> corners_;
  };

  Pixels litPixels(const std::uint8_t* first) const {
    Pixels lit;
    for (int y = 0; y < rows(); ++y, first += stride) {
      for (int x = 0; x < right - left; ++x) {
        const std::uint8_t* const pixel = first + 3 * x;
        lit.at[static_cast<std::size_t>(lit.count)] = static_cast<std::uint8_t>(kBlock * y + x);
        lit.count += (pixel[0] | pixel[1] | pixel[2]) != 0 ? 1 : 0;
      }
    }
    return lit;
  }

  /// Takes those of the pixels that lie inside a surface's outline.
  Pixels takeInside(const PlacedSurface& surface, Pixels& pixels) const {
    const Places places(surface, *this);
    Pixels inside, outside;
    for (int i = 0; i < pixels.count; ++i) {
      const int at = pixels.at[static_cast<std::size_t>(i)];
      const Eigen::Vector3f place = places.row(at / kBlock).at(at % kBlock);
      const bool is_inside = isInside(surface.polygon, place.hnormalized().cast<double>());
      (is_inside ? inside : outside).add(at);
    }
    pixels = outside;
    return inside;
  }

  void sendOthers(const Pixels& pixels, std::uint8_t* first, const Others& others) const {
    for (int i = 0; i < pixels.count; ++i) {
      const int at = pixels.at[static_cast<std::size_t>(i)];
      std::uint8_t* const pixel = first + at / kBlock * stride + 3 * (at % kBlock);
      others(pixel, pixel + 3);
    }
  }

  void findCells(const PlacedSurface& surface);
  void sendPixels(const PlacedSurface& surface, const Pixels& pixels, std::uint8_t* first,
                  Count& count) const;
};

/// A loop without branches over arrays: it becomes vector code. Comparisons are written so that not
/// a number is outside.
AFTERGLOW_VECTOR_CLONES
void TextureLight::Block::findCells(const PlacedSurface& surface) {
  const Texture& texture = *surface.texture;
  const auto columns = static_cast<float>(texture.columns),
             lines = static_cast<float>(texture.rows);
  const int tiles = texture.tiles, outside = static_cast<int>(texture.cells.size()) - 1;
  const float gain =
      static_cast<float>((kLights - 1) * texture.density / surface.density) / magnification;
  const Places places(surface, *this);
  for (int y = 0; y < rows(); ++y) {
    const RowPlaces row = places.row(y);
    const float u = row.begin.x(), v = row.begin.y(), w = row.begin.z();
    const float du = row.step.x(), dv = row.step.y(), dw = row.step.z();
    std::int32_t* const row_cells = &cells[static_cast<std::size_t>(kBlock * y)];
    float* const row_gains = &gains[static_cast<std::size_t>(kBlock * y)];
    for (int x = 0; x < kBlock; ++x) {
      const float along = static_cast<float>(x) + 0.5F, depth = 1 / (w + along * dw);
      const float column = (u + along * du) * depth, line = (v + along * dv) * depth;
      const int is_within = (column >= 0) & (line >= 0) & (column < columns) & (line < lines);
      const int index = tiledIndex(static_cast<int>(is_within ? column : 0),
                                   static_cast<int>(is_within ? line : 0), tiles);
      row_cells[x] = is_within ? index : outside;
      row_gains[x] = gain * depth * depth * depth;
    }
  }
}

AFTERGLOW_VECTOR_CLONES
void TextureLight::Block::sendPixels(const PlacedSurface& surface, const Pixels& pixels,
                                     std::uint8_t* first, Count& count) const {
  constexpr float kMost = kLights - 1, kOver = kTolerance * kMost;
  constexpr Channels kNone = {}, kAll = {kMost, kMost, kMost, kMost};
  // All of it in registers: a pixel might be anything that lies in memory.
  const Texture& texture = *surface.texture;
  const Cell* const all = texture.cells.data();
  const auto offset = static_cast<float>(texture.offset);
  const std::ptrdiff_t row_bytes = stride;
  const std::size_t lit = static_cast<std::size_t>(pixels.count);
  int clipped = 0, unknown = 0;
  for (std::size_t i = 0; i < lit; ++i) __builtin_prefetch(all + cells[pixels.at[i]]);
  for (std::size_t i = 0; i < lit; ++i) {
    const unsigned at = pixels.at[i];
    std::uint8_t* const pixel =
        first + static_cast<int>(at / kBlock) * row_bytes + 3 * (at % kBlock);
    const Cell& cell = all[cells[at]];
    ChannelInts rows;
    std::memcpy(&rows, &cell, sizeof(rows));
    Channels light = {};
    addColumn(rows, 0, surface.lights[0][pixel[0]], light);
    addColumn(rows, 1, surface.lights[1][pixel[1]], light);
    addColumn(rows, 2, surface.lights[2][pixel[2]], light);
    addColumn(rows, 3, offset, light);
    light *= std::abs(cell.scale) * gains[at];
    Channels within = light < kNone ? kNone : light;
    within = kAll < within ? kAll : within;
    const Channels beyond = light - within;
    const ChannelInts is_clipped = (beyond > kOver) | (beyond < -kOver);
    // Both in one number: they are taken out of the vector one by one.
    const ChannelInts found =
        __builtin_convertvector(within + 0.5F, ChannelInts) | (is_clipped & kLights);
    const auto r = static_cast<unsigned>(found[0]), g = static_cast<unsigned>(found[1]),
               b = static_cast<unsigned>(found[2]);
    pixel[0] = texture.sent[0][r % kLights];
    pixel[1] = texture.sent[1][g % kLights];
    pixel[2] = texture.sent[2][b % kLights];
    clipped += static_cast<int>((r | g | b) / kLights);
    unknown += cell.scale < 0 ? 1 : 0;
  }
  count.lit += pixels.count;
  count.clipped += clipped;
  count.unknown += unknown;
}

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

bool TextureLight::place(const std::vector<SurfacePatch>& surfaces,
                         const Rigid<Projector, World>& T_projector_world) {
  std::vector<PlacedSurface> placed;
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
    if (surface.texture) surface.density = std::abs(height);
    placed.push_back(std::move(surface));
  }
  const auto isSame = [](const auto& a, const auto& b) { return a.isSamePlace(b); };
  if (std::equal(placed.begin(), placed.end(), placed_.begin(), placed_.end(), isSame))
    return false;
  placed_ = std::move(placed);
  for (PlacedSurface& surface : placed_) {
    if (surface.texture) setWhite(surface);
  }
  return true;
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
  for (std::size_t value = 0; value < 256; ++value) {
    const double light = calib::lightOfSrgb(static_cast<double>(value) / 255);
    for (auto& lights : surface.lights) {
      lights[value] = static_cast<float>(brightness_ * surface.white * light);
    }
  }
}

void TextureLight::apply(Image& image, const std::vector<SurfacePatch>& surfaces,
                         const Rigid<Projector, World>& T_projector_world, const Others& others) {
  if (image.width != lens_.width || image.height != lens_.height) {
    throw std::logic_error("an image of another size than the lens");
  }
  const bool has_moved = place(surfaces, T_projector_world);
  keeping_ = has_moved                      ? Keeping::Nothing
             : keeping_ == Keeping::Nothing ? Keeping::Begun
                                            : Keeping::All;
  if (keeping_ == Keeping::Begun) drawn_ = sent_ = image;
  counts_.resize((rows_.size() - 1) * (columns_.size() - 1) * textures_.size());
  workers_.run([&](int worker) {
    Block block;
    block.stride = 3 * static_cast<std::ptrdiff_t>(image.width);
    const auto step = static_cast<std::size_t>(workers_.count());
    for (auto row = static_cast<std::size_t>(worker); row + 1 < rows_.size(); row += step) {
      sendRow(image, row, block, others);
    }
  });
  for (TextureReport& report : reports_) report = {report.surface};
  for (const PlacedSurface& surface : placed_) {
    if (!surface.texture) continue;
    TextureReport& report = reports_[surface.index];
    report.white = surface.white;
    report.of_most = surface.of_most;
    for (std::size_t i = surface.index; i < counts_.size(); i += textures_.size()) {
      report.lit += static_cast<std::size_t>(counts_[i].lit);
      report.clipped += static_cast<std::size_t>(counts_[i].clipped);
      report.unknown += static_cast<std::size_t>(counts_[i].unknown);
    }
  }
}

void TextureLight::sendRow(Image& image, std::size_t row, Block& block, const Others& others) {
  block.top = rows_[row];
  block.bottom = rows_[row + 1];
  for (std::size_t column = 0; column + 1 < columns_.size(); ++column) {
    block.left = columns_[column];
    block.right = columns_[column + 1];
    if (keeping_ == Keeping::All && block.isSame(image, drawn_)) {
      block.copy(sent_, image);
      continue;
    }
    if (keeping_ != Keeping::Nothing) block.copy(image, drawn_);
    const std::size_t index = (row * (columns_.size() - 1) + column) * textures_.size();
    std::fill_n(&counts_[index], textures_.size(), Count{});
    if (block.isLit(image)) {
      const std::size_t corner = row * columns_.size() + column, below = corner + columns_.size();
      block.rays = {rays_[corner], rays_[corner + 1], rays_[below], rays_[below + 1]};
      block.magnification = (magnifications_[corner] + magnifications_[below + 1]) / 2;
      findSurfaces(block);
      block.send(image, others, &counts_[index]);
    }
    if (keeping_ != Keeping::Nothing) block.copy(image, sent_);
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
