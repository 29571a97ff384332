/// \file
/// What a camera sees of a tag's cells: each place's whiteness after the lens's and the pixels'
/// blur.
#pragma once

#include <Eigen/Core>

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
  /// Keeps a reference to the cells.
  BlurredTag(const TagCells& cells, const Eigen::Vector2d& sigma_cells)
      : cells_(cells), sigma_(sigma_cells) {}

  Whiteness at(const Eigen::Vector2d& cell) const;

 private:
  bool isWhite(int row, int column) const;

  const TagCells& cells_;
  Eigen::Vector2d sigma_;
};

}  // namespace afterglow::calib
