#include "render/paint/polygon_brush.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

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
constexpr int kSmall = kPixelsAtOnce;

/// Edges lean by so much more (px a row), as what they cover is divided by how they lean.
constexpr float kMoreLean = 1.f / 65536;

/// Some edges of a small outline, each in a lane.
template <int kPixels>
struct SmallEdges {
  using Floats = typename PixelVectors<kPixels>::Depths;
  Floats high, low;    ///< rows of its ends
  Floats x, y;         ///< where it begins
  Floats slope, lean;  ///< columns a row; the same without its sign, and kMoreLean
  Floats weight;       ///< 1 / lean; negative where the edge runs down
};

/// Sets the edges that begin at so many corners as there are lanes; x counts from `left`.
template <int kPixels, int... kLanes>
AFTERGLOW_ALWAYS_INLINE void setEdges(const Corner* corners, float left, SmallEdges<kPixels>& edges,
                                      std::integer_sequence<int, kLanes...> /*lanes*/) {
  using Floats = typename PixelVectors<kPixels>::Depths;
  using Ints = typename PixelVectors<kPixels>::Shares;
  const auto read = [left](const Corner* at, Floats& x, Floats& y) {
    Floats some, more;
    std::memcpy(&some, at, sizeof(some));
    std::memcpy(&more, at + kPixels / 2, sizeof(more));
    shuffle<(2 * kLanes)...>(some, more, x);
    shuffle<(2 * kLanes + 1)...>(some, more, y);
    x -= left;
  };
  Floats to_x, to_y;
  read(corners, edges.x, edges.y);
  read(corners + 1, to_x, to_y);
  const Floats fall = to_y - edges.y, none{}, one = none + 1;
  edges.high = edges.y < to_y ? edges.y : to_y;
  edges.low = edges.y > to_y ? edges.y : to_y;
  // What is level has no height in any row: its slope may be any.
  const Ints falls = reinterpret_cast<Ints>(fall), is_level = fall == none;
  const Ints slanting = falls | (is_level & reinterpret_cast<Ints>(one));
  edges.slope = (to_x - edges.x) / reinterpret_cast<Floats>(slanting);
  edges.lean = edges.slope;
  makePositive<Floats, Ints>(edges.lean);
  edges.lean += kMoreLean;
  const Ints sign = ~falls & std::numeric_limits<std::int32_t>::min();
  edges.weight = reinterpret_cast<Floats>(reinterpret_cast<Ints>(1 / edges.lean) ^ sign);
}

/// Edges within a row.
template <int kPixels>
struct SmallSlices {
  alignas(sizeof(float) * kPixels) float left[kPixels], breadth[kPixels];
};

template <int kPixels>
AFTERGLOW_ALWAYS_INLINE void cut(const SmallEdges<kPixels>& edges, int row,
                                 SmallSlices<kPixels>& slices) {
  using Floats = typename PixelVectors<kPixels>::Depths;
  const Floats above = static_cast<float>(row) - Floats{}, below = above + 1;
  const Floats top = edges.high > above ? edges.high : above;
  Floats bottom = edges.low < below ? edges.low : below;
  bottom = bottom > top ? bottom : top;
  const Floats height = bottom - top, breadth = height * edges.lean;
  const Floats from = edges.x + (top - edges.y) * edges.slope, to = from + height * edges.slope;
  const Floats left = from < to ? from : to;
  std::memcpy(&slices.left, &left, sizeof(left));
  std::memcpy(&slices.breadth, &breadth, sizeof(breadth));
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
  const std::array<Corner, 3 + kCornersMore> corners = {t[0].at, t[1].at, t[2].at, t[0].at};
  const Band band{row_begin, row_end, mask, canvas};
  if (t[0].color == t[1].color && t[1].color == t[2].color) {
    return paintOutline(corners.data(), t.size(), Outline::Polygon, depth, band,
                        lightOf(components(t[0].color)));
  }
  const Four a = components(t[0].color), b = components(t[1].color), c = components(t[2].color);
  const std::array<Plane, 4> planes = {Plane(t, a[0], b[0], c[0]), Plane(t, a[1], b[1], c[1]),
                                       Plane(t, a[2], b[2], c[2]), Plane(t, a[3], b[3], c[3])};
  paintOutline(corners.data(), t.size(), Outline::Polygon, depth, band,
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
  corners_.push_back(corners_[0]);
  corners_.resize(polygon.size() + kCornersMore);
  paintOutline(corners_.data(), polygon.size(), Outline::Polygon,
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
  const bool is_small =
      outline == Outline::Polygon && withLanes(are_eight_, [&](auto lanes) AFTERGLOW_INLINED {
        return paintSmall<lanes.size()>(corners, count, depth, band, light, lanes);
      });
  if (is_small) return;
  const auto fill = [&](int, int, int columns) { std::fill_n(lights_.begin(), columns, light); };
  paintOutline(corners, count, outline, depth, band, fill);
}

/// Goes over every edge in every row: a decision would be foreseen by nobody, and cost more than
/// edges that do not reach the row. Areas left of pixels' right sides give shares by differences.
template <int kPixels, int... kLanes>
inline bool PolygonBrush::paintSmall(const Corner* corners, std::size_t count, const Depth& depth,
                                     const Band& band, Light light,
                                     std::integer_sequence<int, kLanes...> lanes) const {
  using Floats = typename PixelVectors<kPixels>::Depths;
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
  const int rows = std::min(band.row_end - 1, static_cast<int>(most.y)) + 1 - first;
  constexpr int kParts = kSmall / kPixels;
  const int parts = kParts == 1 ? 1 : (columns + kPixels - 1) / kPixels;
  SmallSlices<kPixels> slices[kBandRows];
  Floats areas[kBandRows][kParts];
  const Floats none{}, order{static_cast<float>(kLanes)...};
  for (std::size_t i = 0; i < count; i += kPixels) {
    SmallEdges<kPixels> edges;
    setEdges(corners + i, least.x, edges, lanes);
    for (int row = 0; row < rows; ++row) cut(edges, first + row, slices[row]);
    alignas(Floats) float weight[kPixels];
    std::memcpy(&weight, &edges.weight, sizeof(weight));
    for (int row = 0; row < rows; ++row) {
      for (int part = 0; part < parts; ++part) {
        const Floats right = order + (static_cast<float>(begin + kPixels * part + 1) - least.x);
        Floats area{};
        if (i > 0) area = areas[row][part];
        for (std::size_t k = 0; k < kPixels && i + k < count; ++k) {
          const Floats left = slices[row].left[k] - none, breadth = slices[row].breadth[k] - none;
          const Floats beyond = (right > left ? right : left) - left;
          const Floats over = beyond < breadth ? beyond : breadth;
          area += weight[k] * (over * (beyond - 0.5f * over));
        }
        areas[row][part] = area;
      }
    }
  }
  typename PixelVectors<kPixels>::LightPair lights;
  repeat(light, lights[0]);
  lights[1] = lights[0];
  for (int row = 0; row < rows; ++row) {
    band.canvas.touch(first + row - band.row_begin, begin, begin + columns);
    for (int part = 0; part < parts; ++part) {
      const Floats& to = areas[row][part];
      const Floats from = part == 0 ? none : areas[row][part - 1];
      Floats before;
      shuffle<(kPixels - 1 + kLanes)...>(from, to, before);
      paintPixels<kPixels>(to - before, first + row, begin + kPixels * part, depth, band, lights,
                           lanes);
    }
  }
  return true;
}

void PolygonBrush::paintRow(const float* shares, int row, int begin, int columns,
                            const Depth& depth, const Band& band) const {
  band.canvas.touch(row - band.row_begin, begin, begin + columns);
  withLanes(are_eight_, [&](auto lanes) AFTERGLOW_INLINED {
    constexpr int kPixels = lanes.size();
    for (int i = 0; i < columns; i += kPixels) {
      typename PixelVectors<kPixels>::Depths covered;
      typename PixelVectors<kPixels>::LightPair lights;
      std::memcpy(&covered, shares + i, sizeof(covered));
      for (int k = 0; k < 2; ++k) {
        const auto first = static_cast<std::size_t>(i + k * kPixels / 2);
        std::memcpy(&lights[k], &lights_[first], sizeof(lights[k]));
      }
      paintPixels<kPixels>(covered, row, begin + i, depth, band, lights, lanes);
    }
  });
}

template <int kPixels, int... kLanes>
inline void PolygonBrush::paintPixels(const typename PixelVectors<kPixels>::Depths& shares, int row,
                                      int column, const Depth& depth, const Band& band,
                                      const typename PixelVectors<kPixels>::LightPair& lights,
                                      std::integer_sequence<int, kLanes...> /*lanes*/) const {
  using Depths = typename PixelVectors<kPixels>::Depths;
  using Shares = typename PixelVectors<kPixels>::Shares;
  Depths covered = shares;
  makePositive<Depths, Shares>(covered);
  Shares share = __builtin_convertvector(covered * static_cast<float>(kWhole) + 0.5f, Shares);
  // What is no number has become a negative one.
  share = share > 0 ? share : Shares{};
  share = share > kWhole ? kWhole - Shares{} : share;
  const int line = row - band.row_begin;
  if (band.mask != nullptr) {
    typedef std::uint16_t Mask __attribute__((vector_size(2 * kPixels)));
    Mask allowed;
    std::memcpy(&allowed, band.mask + line * width_ + column, sizeof(allowed));
    share = share * __builtin_convertvector(allowed, Shares) >> 8;
  }
  const Depths center = Depths{(0.5f + kLanes)...} + static_cast<float>(column);
  Depths here = depth.ofRow(row) + depth.by_x * center;
  here = here < depth.least ? depth.least - Depths{} : here;
  here = here > depth.greatest ? depth.greatest - Depths{} : here;
  band.canvas.add<kPixels>(line, column, lights, share, here, depth.slack);
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
