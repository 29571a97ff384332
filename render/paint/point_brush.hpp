/// \file
/// Squares of some pixels, each pixel getting the share that is covered, as shaders/point.frag has
/// it.
#pragma once

#include "render/paint/canvas.hpp"
#include "render/paint/screen_point.hpp"

namespace afterglow::render {

constexpr float kLargestPoint = 250;  ///< px

/// Rows of the image that a point of so many pixels touches.
struct Rows {
  int first, last;
};
Rows rowsOfPoint(const ScreenPoint& point, float size_px);

class PointBrush {
 public:
  PointBrush(int width, float size_px);

  /// Blends the point over the band whose first row is `row_begin`, hidden by what is nearer and
  /// cut by `mask` (shares of kWhole, row by row; nullptr: whole).
  void paint(const ScreenPoint& point, int row_begin, int row_end, const std::uint16_t* mask,
             Canvas& canvas);

 private:
  int width_, size_;
  std::vector<std::uint32_t> shares_;  ///< of the columns, in subpixels
};

}  // namespace afterglow::render
