/// \file
/// Points of a cloud on the image, and colors, as the CPU draws them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "render/scene/mesh.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// 1/256 px: finer than 8-bit coverage can show.
constexpr int kSubpixels = 256;

/// 16 bytes: depth and color side by side in 64 bits, so that sorting by depth moves both.
struct ScreenPoint {
  std::int32_t u, v;    ///< 1/256 px; the center of the top-left pixel is (0, 0)
  std::uint32_t order;  ///< the farthest point, drawn first, has the least
  std::uint32_t color;  ///< r, g, b, a from the lowest byte on

  ScreenPoint() {}  // NOLINT: leaves its values open, so that large buffers grow without a pass
};

/// Points that are drawn together.
struct PointRun {
  std::uint32_t first = 0, count = 0;
  float size_px = 1;
  bool is_ordered = false;  ///< else any order shows the same: one opaque color
  double mean_depth = 0;    ///< see LightVertex::depth
};

/// Sorts a copy by `order`, in time that grows with the number alone, keeping the order of equals.
/// The result lies within `room`, which grows as needed, or is `points` itself, and holds until the
/// next call.
const ScreenPoint* sortByOrder(const ScreenPoint* points, std::size_t count,
                               std::vector<ScreenPoint>& room);

/// r, g, b, a as they lie in memory.
inline std::uint32_t packedColor(const Rgba& color) {
  static_assert(sizeof(Rgba) == sizeof(std::uint32_t));
  std::uint32_t bits;
  std::memcpy(&bits, &color, sizeof(bits));
  return bits;
}

/// r, g, b, a from the lowest byte on; alpha multiplied, the others times the gain. Clamped, and
/// written so that NaN is black.
inline std::uint32_t packedColor(const Color& color, float alpha, float gain) {
  using Floats = float __attribute__((vector_size(16)));
  using Ints = std::int32_t __attribute__((vector_size(16)));
  using Bytes = std::uint8_t __attribute__((vector_size(4)));
  static_assert(sizeof(Color) == sizeof(Floats));
  Floats value;
  std::memcpy(&value, &color, sizeof(value));
  value *= Floats{gain, gain, gain, alpha};
  value = value > 0 ? value : Floats{};
  value = value < 1 ? value : Floats{1, 1, 1, 1};
  const Bytes bytes =
      __builtin_convertvector(__builtin_convertvector(value * 255.f + 0.5f, Ints), Bytes);
  std::uint32_t bits;
  std::memcpy(&bits, &bytes, sizeof(bits));
  return bits;
}

/// The same of 8-bit components, which nearly always stay as they are.
inline std::uint32_t packedColor(const Rgba& color, float alpha, float gain) {
  const bool stays = alpha == 1 && gain == 1;
  return stays ? packedColor(color) : packedColor(asShares(color), alpha, gain);
}

}  // namespace afterglow::render
