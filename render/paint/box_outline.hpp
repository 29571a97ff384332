/// \file
/// Which corners of a box lie on its outline.
#pragma once

#include <array>
#include <cstddef>

namespace afterglow::render {

/// Corners of the outline of a box as seen from one of the 27 regions around it, by whether the eye
/// lies before, between or behind the two faces of each axis. Bit i of a corner: the far end of
/// axis i.
struct BoxOutline {
  int count = 0;
  std::array<int, 6> corners{};
};

/// Region 9 (x + 1) + 3 (y + 1) + z + 1, each side being -1, 0 or 1. Without corners from within.
const BoxOutline& boxOutline(std::size_t region);

}  // namespace afterglow::render
