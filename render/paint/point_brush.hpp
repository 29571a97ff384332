/// \file
/// Squares of some pixels, each pixel getting the share that is covered, as shaders/point.frag has
/// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/paint/canvas.hpp"
#include "render/paint/screen_point.hpp"

namespace afterglow::render {

/// Rows of the image.
struct Rows {
  int first, last;
};

/// Paints points of one size; makes tables for it.
class PointBrush {
 public:
  explicit PointBrush(float size_px);

  /// Returns the rows that a point touches.
  Rows rows(const ScreenPoint& point) const {
    const int top = begin(point.v);
    return {top >> 8, (top + size_ - 1) >> 8};  // shifts round down, also below zero
  }

  /// Blends points, one after the other, over the band whose first row is `row_begin`, hidden by
  /// what is nearer and cut by `mask` (shares of kWhole, row by row; nullptr: whole).
  void paint(const ScreenPoint* points, std::size_t count, int row_begin, int row_end, int width,
             const std::uint16_t* mask, Canvas& canvas) const;

 private:
  /// First subpixel of the square around `center`; pixel i begins at i * kSubpixels.
  int begin(std::int32_t center) const { return center + kSubpixels / 2 - size_ / 2; }
  /// Shares of kSubpixels that the pixels have of a square that begins so many subpixels into the
  /// first of them; none of those beyond it, up to a multiple of four.
  const std::uint16_t* shares(int fraction) const {
    return shares_.data() + static_cast<std::size_t>(fraction) * stride_;
  }

  void paintOne(const ScreenPoint& point, int row_begin, int row_end, int width,
                const std::uint16_t* mask, Canvas& canvas) const;
  /// Paints where nothing but points is, and within the image's sides.
  void paintPlain(const ScreenPoint& point, int row_begin, int row_end, Canvas& canvas) const;

  int size_;  ///< subpixels
  std::size_t stride_;
  std::vector<std::uint16_t> shares_;  ///< shares by fraction
  std::vector<std::uint16_t> lanes_;   ///< the same for each component of the pixels
};

}  // namespace afterglow::render
