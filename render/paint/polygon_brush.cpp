#include "render/paint/polygon_brush.hpp"

#include <algorithm>
#include <cmath>

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

/// The columns of a row; fewer are painted before vectors would have begun.
constexpr int kFewColumns = 12;

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

std::uint32_t inWholeNumbers(float share) {
  const auto whole = static_cast<std::int32_t>(std::abs(share) * kWhole + 0.5f);
  return static_cast<std::uint32_t>(std::min(whole, static_cast<std::int32_t>(kWhole)));
}

}  // namespace

void PolygonBrush::paint(const ScreenTriangle& t, int row_begin, int row_end,
                         const std::uint16_t* mask, Canvas& canvas) {
  const auto [least, greatest] = std::minmax({t[0].depth, t[1].depth, t[2].depth});
  const Plane plane(t, t[0].depth, t[1].depth, t[2].depth);
  const Depth depth{plane.origin(), plane.byX(), plane.byY(), plane.slack() + kLeastSlack,
                    least,          greatest};
  const std::array<Corner, 3> corners = {t[0].at, t[1].at, t[2].at};
  const auto paintWith = [&](const auto& lightAt) {
    paintOutline(corners.data(), corners.size(), Outline::Polygon, row_begin, row_end, mask, canvas,
                 lightAt, depth);
  };
  if (t[0].color == t[1].color && t[1].color == t[2].color) {
    const Light light = lightOf(components(t[0].color));
    return paintWith([light](int, int) { return light; });
  }
  const Four a = components(t[0].color), b = components(t[1].color), c = components(t[2].color);
  const std::array<Plane, 4> planes = {Plane(t, a[0], b[0], c[0]), Plane(t, a[1], b[1], c[1]),
                                       Plane(t, a[2], b[2], c[2]), Plane(t, a[3], b[3], c[3])};
  paintWith([&planes](int column, int row) {
    return lightOf({planes[0].at(column, row), planes[1].at(column, row), planes[2].at(column, row),
                    planes[3].at(column, row)});
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
  const Light light = lightOf(components(polygon[0].color));
  paintOutline(corners_.data(), corners_.size(), Outline::Polygon, row_begin, row_end, mask, canvas,
               [light](int, int) { return light; },
               {plane.origin(), plane.byX(), plane.byY(), slack, least, greatest});
}

void PolygonBrush::paint(const Sprite& sprite, const Corner* corners, int row_begin, int row_end,
                         const std::uint16_t* mask, Canvas& canvas) {
  const Light light = lightOf(components(sprite.color));
  paintOutline(corners, sprite.count, sprite.outline, row_begin, row_end, mask, canvas,
               [light](int, int) { return light; },
               {sprite.depth, sprite.by_x, sprite.by_y, sprite.slack});
}

AFTERGLOW_VECTOR_CLONES
void PolygonBrush::setRow(const float* shares, const std::uint16_t* allowed, int begin, int columns,
                          float first_depth, const Depth& depth) {
  std::uint32_t* whole = shares_.data();
  for (int i = 0; i < columns; ++i) whole[i] = inWholeNumbers(shares[i]);
  for (int i = 0; allowed != nullptr && i < columns; ++i) {
    whole[i] = whole[i] * allowed[begin + i] / kWhole;
  }
  float* depths = depths_.data();
  for (int i = 0; i < columns; ++i) depths[i] = depth.at(first_depth, begin + i);
}

template <typename LightAt>
void PolygonBrush::paintOutline(const Corner* corners, std::size_t count, Outline outline,
                                int row_begin, int row_end, const std::uint16_t* mask,
                                Canvas& canvas, const LightAt& lightAt, const Depth& depth) {
  coverage_.visit(
      corners, count, outline, row_begin, row_end,
      [&](int row, int begin, int columns, const float* shares) {
        const int line = row - row_begin;
        canvas.touch(line, begin, begin + columns);
        const float first_depth = depth.ofRow(row);
        const auto add = [&](int column, std::uint32_t share, float here) {
          if (share == 0) return;
          canvas.add(line, column, lightAt(column, row), share, here, depth.slack);
        };
        const std::uint16_t* allowed = mask == nullptr ? nullptr : mask + line * width_;
        if (columns < kFewColumns && allowed == nullptr) {
          for (int i = 0; i < columns; ++i) {
            add(begin + i, inWholeNumbers(shares[i]), depth.at(first_depth, begin + i));
          }
          return;
        }
        setRow(shares, allowed, begin, columns, first_depth, depth);
        for (int i = 0; i < columns; ++i) {
          const auto at = static_cast<std::size_t>(i);
          add(begin + i, shares_[at], depths_[at]);
        }
      });
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
