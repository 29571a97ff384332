#include "render/paint/polygon_brush.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "render/paint/vector_clones.hpp"

namespace afterglow::render {
namespace {

using Four = std::array<float, 4>;

Light lightOf(const Four& rgba) {
  const float alpha = rgba[3] / 255;
  const auto lane = [](float value) { return static_cast<std::uint16_t>(value + 0.5f); };
  return Light{lane(rgba[0] * alpha), lane(rgba[1] * alpha), lane(rgba[2] * alpha), lane(rgba[3])};
}

Four components(std::uint32_t color) {
  const auto at = [color](int shift) { return static_cast<float>(color >> shift & 0xff); };
  return {at(0), at(8), at(16), at(24)};
}

/// A value that is linear over the triangle, kept between the corners' least and greatest.
class Plane {
 public:
  Plane(const ScreenTriangle& t, float a, float b, float c) : least_(std::min({a, b, c})) {
    greatest_ = std::max({a, b, c});
    const float bx = t[1].at.x - t[0].at.x, by = t[1].at.y - t[0].at.y;
    const float cx = t[2].at.x - t[0].at.x, cy = t[2].at.y - t[0].at.y;
    const float area = bx * cy - cx * by;
    // A sliver's plane could be anything: its corners' values have to do.
    if (std::abs(area) > 1e-6f) {
      by_x_ = ((b - a) * cy - (c - a) * by) / area;
      by_y_ = ((c - a) * bx - (b - a) * cx) / area;
    }
    origin_ = a - by_x_ * t[0].at.x - by_y_ * t[0].at.y;
  }
  /// Beyond its corners, too.
  float at(const Corner& corner) const { return origin_ + by_x_ * corner.x + by_y_ * corner.y; }
  /// Returns the depth at the pixel's center.
  float at(int column, int row) const {
    const float value = origin_ + by_x_ * (static_cast<float>(column) + 0.5f) +
                        by_y_ * (static_cast<float>(row) + 0.5f);
    return std::clamp(value, least_, greatest_);
  }
  /// Returns how far it may change from a pixel's center to its corner.
  float slack() const {
    return std::min(0.75f * (std::abs(by_x_) + std::abs(by_y_)), greatest_ - least_);
  }

  float origin() const { return origin_; }
  float byX() const { return by_x_; }
  float byY() const { return by_y_; }

 private:
  float least_, greatest_;
  float by_x_ = 0, by_y_ = 0, origin_;
};

/// Floats around 1, where depths are, differ by no less.
constexpr float kLeastSlack = 2e-7f;

/// The columns of a small outline.
constexpr int kSmall = 2 * kPixelsAtOnce;
using SmallRow = float __attribute__((vector_size(4 * kSmall)));

/// An edge is so far (px) from upright at least within a row: what it covers is divided by that.
constexpr float kLeastBreadth = 1.f / 512;

/// Twice the sum of a pixel's shares on the left of borders between two, which lie so far right of
/// its left side.
AFTERGLOW_ALWAYS_INLINE void addUp(const SmallRow& from, const SmallRow& to, SmallRow& out) {
  constexpr SmallRow kNone = {}, kAll = {1, 1, 1, 1, 1, 1, 1, 1};
  const SmallRow a = from < kNone ? kNone : from, b = to < kNone ? kNone : to;
  const SmallRow a_in = kAll < a ? kAll : a, b_in = kAll < b ? kAll : b;
  const SmallRow beyond = b - a;
  out = (b_in - a_in) * (b_in + a_in - 2) + (beyond + beyond);
}

/// Through corners far apart.
Plane planeOf(const ScreenPolygon& polygon) {
  const ScreenVertex &a = polygon[0], &b = polygon[polygon.size() / 3],
                     &c = polygon[2 * polygon.size() / 3];
  return {{a, b, c}, a.depth, b.depth, c.depth};
}

float farthestFrom(const Plane& plane, const ScreenPolygon& polygon) {
  float farthest = 0;
  for (const ScreenVertex& vertex : polygon) {
    farthest = std::max(farthest, std::abs(vertex.depth - plane.at(vertex.at)));
  }
  return farthest;
}

}  // namespace

void PolygonBrush::paint(const ScreenTriangle& t, int row_begin, int row_end,
                         const std::uint16_t* mask, Canvas& canvas) {
  const auto [least, greatest] = std::minmax({t[0].depth, t[1].depth, t[2].depth});
  const Plane plane(t, t[0].depth, t[1].depth, t[2].depth);
  const Depth depth{plane.origin(), plane.byX(), plane.byY(), plane.slack() + kLeastSlack,
                    least,          greatest};
  const std::array<Corner, 3> corners = {t[0].at, t[1].at, t[2].at};
  const Band band{row_begin, row_end, mask, canvas};
  if (t[0].color == t[1].color && t[1].color == t[2].color) {
    return paintOutline(corners.data(), corners.size(), Outline::Polygon, depth, band,
                        lightOf(components(t[0].color)));
  }
  const Four a = components(t[0].color), b = components(t[1].color), c = components(t[2].color);
  const std::array<Plane, 4> planes = {Plane(t, a[0], b[0], c[0]), Plane(t, a[1], b[1], c[1]),
                                       Plane(t, a[2], b[2], c[2]), Plane(t, a[3], b[3], c[3])};
  paintOutline(corners.data(), corners.size(), Outline::Polygon, depth, band,
               [&](int row, int begin, int columns) {
                 for (int i = 0; i < columns; ++i) {
                   const int column = begin + i;
                   lights_[static_cast<std::size_t>(i)] =
                       lightOf({planes[0].at(column, row), planes[1].at(column, row),
                                planes[2].at(column, row), planes[3].at(column, row)});
                 }
               });
}

bool PolygonBrush::isFlat(const ScreenPolygon& polygon) {
  const Plane plane = planeOf(polygon);
  return farthestFrom(plane, polygon) <= plane.slack() + kLeastSlack;
}

void PolygonBrush::paint(const ScreenPolygon& polygon, int row_begin, int row_end,
                         const std::uint16_t* mask, Canvas& canvas) {
  const Plane plane = planeOf(polygon);
  const float slack = plane.slack() + farthestFrom(plane, polygon) + kLeastSlack;
  float least = polygon[0].depth, greatest = least;
  corners_.clear();
  for (const ScreenVertex& vertex : polygon) {
    least = std::min(least, vertex.depth);
    greatest = std::max(greatest, vertex.depth);
    corners_.push_back(vertex.at);
  }
  paintOutline(corners_.data(), corners_.size(), Outline::Polygon,
               {plane.origin(), plane.byX(), plane.byY(), slack, least, greatest},
               {row_begin, row_end, mask, canvas}, lightOf(components(polygon[0].color)));
}

void PolygonBrush::paint(const Sprite& sprite, const Corner* corners, int row_begin, int row_end,
                         const std::uint16_t* mask, Canvas& canvas) {
  paintOutline(corners, sprite.count, sprite.outline,
               {sprite.depth, sprite.by_x, sprite.by_y, sprite.slack},
               {row_begin, row_end, mask, canvas}, lightOf(components(sprite.color)));
}

template <typename SetLights>
void PolygonBrush::paintOutline(const Corner* corners, std::size_t count, Outline outline,
                                const Depth& depth, const Band& band, const SetLights& setLights) {
  coverage_.visit(corners, count, outline, band.row_begin, band.row_end,
                  [&](int row, int begin, int columns, const float* shares) {
                    setLights(row, begin, columns);
                    paintRow(shares, row, begin, columns, depth, band);
                  });
}

void PolygonBrush::paintOutline(const Corner* corners, std::size_t count, Outline outline,
                                const Depth& depth, const Band& band, Light light) {
  if (paintSmall(corners, count, outline, depth, band, light)) return;
  const auto fill = [&](int, int, int columns) { std::fill_n(lights_.begin(), columns, light); };
  paintOutline(corners, count, outline, depth, band, fill);
}

/// Edge by edge and row by row, all columns at once: what lies right of the edge is covered.
AFTERGLOW_VECTOR_CLONES
bool PolygonBrush::paintSmall(const Corner* corners, std::size_t count, Outline outline,
                              const Depth& depth, const Band& band, Light light) const {
  Corner least = corners[0], most = least;
  for (std::size_t i = 1; i < count; ++i) {
    least = {std::min(least.x, corners[i].x), std::min(least.y, corners[i].y)};
    most = {std::max(most.x, corners[i].x), std::max(most.y, corners[i].y)};
  }
  const bool is_within = least.x >= 0 && most.x < static_cast<float>(width_) &&
                         least.y > -PolygonCoverage::kFarthest &&
                         most.y < PolygonCoverage::kFarthest;
  if (!is_within) return false;
  const int begin = static_cast<int>(least.x), columns = static_cast<int>(most.x) + 1 - begin;
  if (columns > kSmall) return false;
  const int first = std::max(band.row_begin, static_cast<int>(least.y));
  const int last = std::min(band.row_end - 1, static_cast<int>(most.y));
  std::array<SmallRow, kBandRows> shares;
  std::fill_n(shares.begin(), std::max(0, last - first + 1), SmallRow{});
  const SmallRow right = SmallRow{1, 2, 3, 4, 5, 6, 7, 8} + static_cast<float>(begin);
  const std::size_t step = outline == Outline::Polygon ? 1 : 2;
  for (std::size_t i = 0; i < count; i += step) {
    const Corner &a = corners[i], &b = corners[i + 1 < count ? i + 1 : 0];
    const bool is_up = b.y < a.y;
    const Corner &high = is_up ? b : a, &low = is_up ? a : b;
    if (!(low.y > high.y)) continue;
    const float slope = (low.x - high.x) / (low.y - high.y), half = is_up ? 0.5f : -0.5f;
    const int end = std::min(last, static_cast<int>(low.y));
    for (int row = std::max(first, static_cast<int>(high.y)); row <= end; ++row) {
      const float top = std::max(high.y, static_cast<float>(row));
      const float bottom = std::min(low.y, static_cast<float>(row + 1));
      const float from = high.x + (top - high.y) * slope;
      const float to = high.x + (bottom - high.y) * slope;
      const float edge = std::min(from, to), breadth = std::max(std::abs(to - from), kLeastBreadth);
      SmallRow covered;
      addUp(right - (edge + breadth), right - edge, covered);
      shares[static_cast<std::size_t>(row - first)] += half * (bottom - top) / breadth * covered;
    }
  }
  Lights lights;
  repeat(light, lights);
  for (int row = first; row <= last; ++row) {
    const auto* const all =
        reinterpret_cast<const float*>(&shares[static_cast<std::size_t>(row - first)]);
    band.canvas.touch(row - band.row_begin, begin, begin + columns);
    paintPixels(all, row, begin, depth, band, lights);
    if (columns > kPixelsAtOnce) {
      paintPixels(all + kPixelsAtOnce, row, begin + kPixelsAtOnce, depth, band, lights);
    }
  }
  return true;
}

AFTERGLOW_VECTOR_CLONES
void PolygonBrush::paintRow(const float* shares, int row, int begin, int columns,
                            const Depth& depth, const Band& band) const {
  band.canvas.touch(row - band.row_begin, begin, begin + columns);
  for (int i = 0; i < columns; i += kPixelsAtOnce) {
    Lights lights;
    std::memcpy(&lights, &lights_[static_cast<std::size_t>(i)], sizeof(lights));
    paintPixels(shares + i, row, begin + i, depth, band, lights);
  }
}

AFTERGLOW_ALWAYS_INLINE void PolygonBrush::paintPixels(const float* shares, int row, int column,
                                                       const Depth& depth, const Band& band,
                                                       const Lights& lights) const {
  constexpr Depths kAll = {1, 1, 1, 1};
  Depths covered;
  std::memcpy(&covered, shares, sizeof(covered));
  makePositive<Depths, Shares>(covered);
  covered = kAll < covered ? kAll : covered;
  Shares share = __builtin_convertvector(covered * static_cast<float>(kWhole) + 0.5f, Shares);
  const int line = row - band.row_begin;
  if (band.mask != nullptr) {
    std::uint16_t __attribute__((vector_size(2 * kPixelsAtOnce))) allowed;
    std::memcpy(&allowed, band.mask + line * width_ + column, sizeof(allowed));
    share = share * __builtin_convertvector(allowed, Shares) >> 8;
  }
  const Depths center = __builtin_convertvector(Shares{0, 1, 2, 3} + column, Depths) + 0.5f;
  Depths here = depth.ofRow(row) + depth.by_x * center;
  here = here < depth.least ? depth.least - Depths{} : here;
  here = here > depth.greatest ? depth.greatest - Depths{} : here;
  band.canvas.add(line, column, lights, share, here, depth.slack);
}

void PolygonBrush::add(const ScreenTriangle& t, int row_begin, int row_end, float* sums) {
  const std::array<Corner, 3> corners = {t[0].at, t[1].at, t[2].at};
  coverage_.visit(corners.data(), corners.size(), Outline::Polygon, row_begin, row_end,
                  [&](int row, int begin, int count, const float* shares) {
                    float* out = sums + (row - row_begin) * width_ + begin;
                    for (int i = 0; i < count; ++i) out[i] += shares[i];
                  });
}

}  // namespace afterglow::render
