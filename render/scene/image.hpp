/// \file
/// Finished images, and their edges without stairs.
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

/// Mixes along the edge where brightness jumps between neighbors, as far as the jump is strong.
/// This stands in place of multisampling, which costs a CPU four times the shading; and on the CPU,
/// because most of an image has no edge, which OpenGL in software would not be spared. The idea is
/// FXAA's (Lottes, NVIDIA 2009).
void smoothEdges(Image& image);

}  // namespace afterglow::render
