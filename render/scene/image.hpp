/// \file
/// Finished images.
#pragma once

#include <cstdint>
#include <vector>

namespace afterglow::render {

/// 8-bit sRGB, row by row from the top, no padding.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

}  // namespace afterglow::render
