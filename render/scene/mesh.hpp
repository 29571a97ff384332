/// \file
/// Shapes as colored triangles and pixel-sized points.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace afterglow::render {

/// 8-bit sRGB and alpha.
struct Rgba {
  std::uint8_t r = 255, g = 255, b = 255, a = 255;
  friend bool operator==(const Rgba& x, const Rgba& y) {
    return x.r == y.r && x.g == y.g && x.b == y.b && x.a == y.a;
  }
  friend bool operator!=(const Rgba& x, const Rgba& y) { return !(x == y); }
};

inline bool isOpaque(const Rgba& color) { return color.a == 255; }
inline bool isInvisible(const Rgba& color) { return color.a == 0; }

/// 0 to 255, for mixing; `gain` is of the light alone.
inline Eigen::Vector4f asFloats(const Rgba& color, float gain = 1) {
  return Eigen::Vector4f(gain * color.r, gain * color.g, gain * color.b, color.a);
}

inline Rgba asBytes(const Eigen::Vector4f& color) {
  const auto byte = [](float value) {
    return static_cast<std::uint8_t>(std::clamp(value, 0.f, 255.f) + 0.5f);
  };
  return {byte(color[0]), byte(color[1]), byte(color[2]), byte(color[3])};
}

/// World coordinates, meters. A vertex is shared by the triangles of one smooth or flat body;
/// triangles have no winding: both sides are seen.
struct Mesh {
  std::vector<Eigen::Vector3d> points;
  std::vector<Rgba> colors;  ///< one a point
  std::vector<std::array<std::uint32_t, 3>> triangles;

  void clear() {
    points.clear();
    colors.clear();
    triangles.clear();
  }
};

/// A square on the image, whatever its distance.
struct Splat {
  Eigen::Vector3d p_world;
  Rgba color;
  float size_px = 1;
};

}  // namespace afterglow::render
