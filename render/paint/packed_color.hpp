/// \file
/// Colors as the CPU draws them.
#pragma once

#include <algorithm>
#include <cstdint>

#include "render/scene/scene.hpp"

namespace afterglow::render {

/// r, g, b, a from the lowest byte on; alpha multiplied, the others times the gain. Clamped, and
/// written so that NaN is black.
inline std::uint32_t packedColor(const Color& color, float alpha, float gain) {
  const auto byte = [](float value) {
    return static_cast<std::uint32_t>(255 * (value > 0 ? std::min(value, 1.f) : 0) + 0.5f);
  };
  return byte(gain * color.r) | byte(gain * color.g) << 8 | byte(gain * color.b) << 16 |
         byte(color.a * alpha) << 24;
}

}  // namespace afterglow::render
