/// \file
/// What a camera sees of a tag's cells: each place's whiteness after the lens's and the pixels'
/// blur.
#pragma once

#include <Eigen/Core>
#include <array>

#include "calib/targets/tag_family.hpp"

namespace afterglow::calib {

/// How white a place of the tag is after blurring, and how that changes along x and y (per cell)
/// and with the logarithm of the blur.
struct Whiteness {
  double value = 0, dx = 0, dy = 0, dblur = 0;
};

/// Cells seen through a Gaussian blur, in cell coordinates: the black frame spans 0 to kTagCells,
/// all around is white. The blur is taken as separable along the tag's axes, which it is up to
/// shear.
class BlurredTag {
 public:
  BlurredTag(const TagCells& cells, const Eigen::Vector2d& sigma_cells);

  /// Up to a cell and a half outside the black frame.
  Whiteness at(const Eigen::Vector2d& cell) const;

 private:
  /// White cells all around, so that no place needs a look at the edges.
  static constexpr int kMargin = 4, kSide = kTagCells + 2 * kMargin;
  std::array<std::array<double, kSide>, kSide> white_;  ///< 1 or 0
  Eigen::Vector2d sigma_;
};

}  // namespace afterglow::calib
