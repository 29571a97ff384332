/// \file
/// Colors as messages have them, and as pictures and sensors do; shapes as colored triangles and
/// pixel-sized points.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace afterglow::render {

/// sRGB components and alpha, each 0..1. A projector adds light: alpha blends over black.
struct Color {
  float r = 1, g = 1, b = 1, a = 1;
  friend bool operator==(const Color& x, const Color& y) {
    return x.r == y.r && x.g == y.g && x.b == y.b && x.a == y.a;
  }
};

/// 8-bit sRGB and alpha.
struct Rgba {
  std::uint8_t r = 255, g = 255, b = 255, a = 255;
  friend bool operator==(const Rgba& x, const Rgba& y) {
    return x.r == y.r && x.g == y.g && x.b == y.b && x.a == y.a;
  }
  friend bool operator!=(const Rgba& x, const Rgba& y) { return !(x == y); }
};

using ColorList = std::vector<Color>;     ///< empty, or one a point
using ByteColorList = std::vector<Rgba>;  ///< the same

inline bool isOpaque(const Rgba& color) { return color.a == 255; }
inline bool isInvisible(const Rgba& color) { return color.a == 0; }

/// Rounded; authors send 255 for 1: clamped, and NaN is black.
inline Rgba asBytes(const Color& color) {
  const auto byte = [](float value) {
    return static_cast<std::uint8_t>(255 * (value > 0 ? std::min(value, 1.f) : 0) + 0.5f);
  };
  return {byte(color.r), byte(color.g), byte(color.b), byte(color.a)};
}
inline ByteColorList asBytes(const ColorList& colors) {
  ByteColorList bytes(colors.size());
  std::transform(colors.begin(), colors.end(), bytes.begin(),
                 [](const Color& color) { return asBytes(color); });
  return bytes;
}

inline Color asShares(const Rgba& color) {
  const auto share = [](std::uint8_t byte) { return static_cast<float>(byte) / 255.f; };
  return {share(color.r), share(color.g), share(color.b), share(color.a)};
}

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
  std::vector<Rgba> colors;  ///< a color for each point
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
