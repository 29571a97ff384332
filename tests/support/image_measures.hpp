/// \file
/// What tests ask of an image.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "render/scene/image.hpp"

namespace afterglow::test {

inline const std::uint8_t* pixelAt(const render::Image& image, int u, int v) {
  const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width);
  return &image.rgb[3 * (row + static_cast<std::size_t>(u))];
}

/// The sum of a pixel's components, 0 .. 765.
inline int brightness(const render::Image& image, int u, int v) {
  if (u < 0 || v < 0 || u >= image.width || v >= image.height) return 0;
  const std::uint8_t* pixel = pixelAt(image, u, v);
  return pixel[0] + pixel[1] + pixel[2];
}

/// Brightness-weighted center within `radius` pixels (a square) of a place; empty if it is dark.
inline std::optional<Eigen::Vector2d> centroid(const render::Image& image,
                                               const Eigen::Vector2d& around, int radius) {
  const int u0 = static_cast<int>(std::lround(around.x()));
  const int v0 = static_cast<int>(std::lround(around.y()));
  double sum = 0;
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
  for (int v = v0 - radius; v <= v0 + radius; ++v) {
    for (int u = u0 - radius; u <= u0 + radius; ++u) {
      const double weight = brightness(image, u, v);
      sum += weight;
      weighted += weight * Eigen::Vector2d(u, v);
    }
  }
  if (sum == 0) return std::nullopt;
  return Eigen::Vector2d(weighted / sum);
}

/// How many pixels are not black.
inline int litPixels(const render::Image& image) {
  int count = 0;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) count += brightness(image, u, v) > 0;
  }
  return count;
}

/// Covered area in pixels, if what is drawn is white.
inline double whiteArea(const render::Image& image) {
  double sum = 0;
  for (const std::uint8_t value : image.rgb) sum += value;
  return sum / (3 * 255);
}

}  // namespace afterglow::test
