#include "render/paint/polygon_brush.hpp"

#include <cmath>

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
  /// At the pixel's center.
  float at(int column, int row) const {
    return std::clamp(plainAt(column, row), least_, greatest_);
  }
  /// The same, whatever the corners have.
  float plainAt(int column, int row) const {
    return origin_ + by_x_ * (static_cast<float>(column) + 0.5f) +
           by_y_ * (static_cast<float>(row) + 0.5f);
  }
  /// How far it may change from a pixel's center to its corner.
  float slack() const {
    return std::min(0.75f * (std::abs(by_x_) + std::abs(by_y_)), greatest_ - least_);
  }

 private:
  float least_, greatest_;
  float by_x_ = 0, by_y_ = 0, origin_;
};

/// Floats around 1, where depths are, differ by no less.
constexpr float kLeastSlack = 2e-7f;

}  // namespace

void PolygonBrush::paint(const ScreenTriangle& t, int row_begin, int row_end,
                         const std::uint16_t* mask, Canvas& canvas) {
  const Plane depth(t, t[0].depth, t[1].depth, t[2].depth);
  const float slack = depth.slack() + kLeastSlack;
  const std::array<Corner, 3> corners = {t[0].at, t[1].at, t[2].at};
  const auto paintWith = [&](const auto& lightAt) {
    paintOutline(
        corners.data(), corners.size(), Outline::Polygon, row_begin, row_end, mask, canvas, lightAt,
        [&](int column, int row) { return depth.at(column, row); }, slack);
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

void PolygonBrush::paint(const ScreenQuad& q, int row_begin, int row_end, const std::uint16_t* mask,
                         Canvas& canvas) {
  const Plane depth({q[0], q[1], q[2]}, q[0].depth, q[1].depth, q[2].depth);
  const float least = std::min({q[0].depth, q[1].depth, q[2].depth, q[3].depth});
  const float greatest = std::max({q[0].depth, q[1].depth, q[2].depth, q[3].depth});
  const float slack = std::max(depth.slack(), (greatest - least) / 8) + kLeastSlack;
  const std::array<Corner, 4> corners = {q[0].at, q[1].at, q[2].at, q[3].at};
  const Light light = lightOf(components(q[0].color));
  paintOutline(
      corners.data(), corners.size(), Outline::Polygon, row_begin, row_end, mask, canvas,
      [light](int, int) { return light; },
      [&](int column, int row) { return std::clamp(depth.plainAt(column, row), least, greatest); },
      slack);
}

void PolygonBrush::paint(const Sprite& sprite, const Corner* corners, int row_begin, int row_end,
                         const std::uint16_t* mask, Canvas& canvas) {
  const Light light = lightOf(components(sprite.color));
  const auto depthAt = [&](int column, int row) {
    return sprite.depth + sprite.by_x * (static_cast<float>(column) + 0.5f) +
           sprite.by_y * (static_cast<float>(row) + 0.5f);
  };
  paintOutline(
      corners, sprite.count, sprite.outline, row_begin, row_end, mask, canvas,
      [light](int, int) { return light; }, depthAt, sprite.slack);
}

template <typename LightAt, typename DepthAt>
void PolygonBrush::paintOutline(const Corner* corners, std::size_t count, Outline outline,
                                int row_begin, int row_end, const std::uint16_t* mask,
                                Canvas& canvas, const LightAt& lightAt, const DepthAt& depthAt,
                                float slack) {
  coverage_.visit(
      corners, count, outline, row_begin, row_end,
      [&](int row, int begin, int columns, const float* shares) {
        canvas.touch(row - row_begin, begin, begin + columns);
        const std::uint16_t* allowed =
            mask == nullptr ? nullptr : mask + (row - row_begin) * width_;
        for (int column = begin; column < begin + columns; ++column) {
          auto share = static_cast<std::uint32_t>(std::abs(shares[column - begin]) * kWhole + 0.5f);
          share = std::min(share, kWhole);
          if (allowed != nullptr) share = share * allowed[column] / kWhole;
          if (share == 0) continue;
          canvas.add(row - row_begin, column, lightAt(column, row), share, depthAt(column, row),
                     slack);
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
