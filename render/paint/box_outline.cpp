#include "render/paint/box_outline.hpp"

#include <utility>

namespace afterglow::render {
namespace {

/// Edges of the faces that are seen, without those that two of them share.
BoxOutline outlineFrom(const std::array<int, 3>& side) {
  std::array<int, 8> next;
  next.fill(-1);
  std::array<std::array<bool, 8>, 8> has{};
  for (int axis = 0; axis < 3; ++axis) {
    if (side[static_cast<std::size_t>(axis)] == 0) continue;
    const bool far = side[static_cast<std::size_t>(axis)] > 0;
    const int b = 1 << (axis + 1) % 3, c = 1 << (axis + 2) % 3, base = far ? 1 << axis : 0;
    // Counterclockwise from outside.
    std::array<int, 4> face = {base, base | b, base | b | c, base | c};
    if (!far) std::swap(face[1], face[3]);
    for (std::size_t i = 0; i < 4; ++i) {
      has[static_cast<std::size_t>(face[i])][static_cast<std::size_t>(face[(i + 1) % 4])] = true;
    }
  }
  int start = -1;
  for (std::size_t a = 0; a < 8; ++a) {
    for (std::size_t b = 0; b < 8; ++b) {
      if (!has[a][b] || has[b][a]) continue;
      next[a] = static_cast<int>(b);
      start = static_cast<int>(a);
    }
  }
  BoxOutline outline;
  if (start < 0) return outline;
  int at = start;
  do {
    outline.corners[static_cast<std::size_t>(outline.count++)] = at;
    at = next[static_cast<std::size_t>(at)];
  } while (at != start && outline.count < 6);
  return outline;
}

}  // namespace

const BoxOutline& boxOutline(std::size_t region) {
  static const std::array<BoxOutline, 27> outlines = [] {
    std::array<BoxOutline, 27> all;
    for (int i = 0; i < 27; ++i) {
      all[static_cast<std::size_t>(i)] = outlineFrom({i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1});
    }
    return all;
  }();
  return outlines[region];
}

}  // namespace afterglow::render
