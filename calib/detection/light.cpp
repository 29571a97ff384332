#include "calib/detection/light.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace afterglow::calib {
namespace {

constexpr double kGamma = 2.2;

struct Decoded {
  float value, weight;
};

std::array<Decoded, 256> decodingTable() {
  std::array<Decoded, 256> table{};
  for (std::size_t gray = 0; gray < 256; ++gray) {
    const double g = double(gray) / 255;
    // The curve is flat at black; a gray level below 4 is as uncertain as one of 4.
    const double slope = kGamma * std::pow(std::max(g, 4.0 / 255), kGamma - 1) / 255;
    const double sigma = slope * kGrayNoise;
    table[gray] = {float(std::pow(g, kGamma)), gray >= 254 ? 0.0f : float(1 / (sigma * sigma))};
  }
  return table;
}

/// Squared length of the gradient of ln(light), 1/px^2.
double relativeEdge(const Light& light, int x, int y) {
  const auto at = [&](int u, int v) {
    u = std::clamp(u, 0, light.width - 1);
    v = std::clamp(v, 0, light.height - 1);
    return double(light.value[std::size_t(v) * std::size_t(light.width) + std::size_t(u)]);
  };
  const double dx = (at(x + 1, y) - at(x - 1, y)) / 2, dy = (at(x, y + 1) - at(x, y - 1)) / 2;
  const double middle = std::max(at(x, y), 1e-4);
  return (dx * dx + dy * dy) / (middle * middle);
}

}  // namespace

Light linearLight(const Picture& picture) {
  static const std::array<Decoded, 256> table = decodingTable();
  Light light;
  light.width = picture.width;
  light.height = picture.height;
  light.value.resize(picture.pixels.size());
  light.weight.resize(picture.pixels.size());
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    light.value[i] = table[picture.pixels[i]].value;
    light.weight[i] = table[picture.pixels[i]].weight;
  }
  return light;
}

Light quotient(const Light& pattern, const Light& plain) {
  if (pattern.width != plain.width || pattern.height != plain.height) {
    throw std::invalid_argument(
        fmt::format("the pattern's picture is {} x {}, the plain one {} x {}", pattern.width,
                    pattern.height, plain.width, plain.height));
  }
  // Where print and pattern both have an edge, blur does not commute with the quotient: the error
  // is about this many pixels times the print's relative edge.
  constexpr double kEdgeMisfit_px = 0.5;
  Light result;
  result.width = plain.width;
  result.height = plain.height;
  result.value.assign(plain.value.size(), 0);
  result.weight.assign(plain.value.size(), 0);
  for (int y = 0; y < plain.height; ++y) {
    for (int x = 0; x < plain.width; ++x) {
      const std::size_t i = std::size_t(y) * std::size_t(plain.width) + std::size_t(x);
      const double above = double(pattern.value[i]), below = std::max(double(plain.value[i]), 1e-4);
      const double q = above / below;
      result.value[i] = float(q);
      if (pattern.weight[i] == 0 || plain.weight[i] == 0) continue;
      const double variance = 1 / double(pattern.weight[i]) / (below * below) +
                              q * q / double(plain.weight[i]) / (below * below) +
                              q * q * kEdgeMisfit_px * kEdgeMisfit_px * relativeEdge(plain, x, y);
      result.weight[i] = float(1 / variance);
    }
  }
  return result;
}

Picture encoded(const Light& light) {
  std::vector<float> sorted = light.value;
  const auto high = sorted.begin() + std::ptrdiff_t(sorted.size() * 99 / 100);
  std::nth_element(sorted.begin(), high, sorted.end());
  const float scale = *high > 0 ? 1 / *high : 1;
  Picture picture{light.width, light.height, std::vector<std::uint8_t>(light.value.size())};
  for (std::size_t i = 0; i < light.value.size(); ++i) {
    // A square root is near enough to gamma 2.2 for a detector, and ten times as fast.
    const float level = 220 * std::sqrt(std::max(0.0f, light.value[i] * scale));
    picture.pixels[i] = std::uint8_t(std::min(level + 0.5f, 255.0f));
  }
  return picture;
}

}  // namespace afterglow::calib
