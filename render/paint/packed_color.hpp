/// \file
/// Colors as the CPU draws them.
#pragma once

#include <cstdint>
#include <cstring>

#include "render/scene/mesh.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

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

}  // namespace afterglow::render
