/// \file
/// Points of a cloud on the image, as the CPU draws them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

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
  double mean_depth = 0;    ///< as LightVertex::depth
};

/// Sorts a copy by `order`, in time that grows with the number alone, keeping the order of equals.
/// The result lies within `room`, which grows as needed, or is `points` itself, and holds until the
/// next call.
const ScreenPoint* sortByOrder(const ScreenPoint* points, std::size_t count,
                               std::vector<ScreenPoint>& room);

}  // namespace afterglow::render
