/// \file
/// Finished images.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace afterglow::render {

/// 8-bit sRGB, row by row from the top, no padding.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Returns whether any pixel is not black.
inline bool isLit(const Image& image) {
  return std::any_of(image.rgb.begin(), image.rgb.end(),
                     [](std::uint8_t byte) { return byte != 0; });
}

}  // namespace afterglow::render
