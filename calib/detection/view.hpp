/// \file
/// What one pose of the board gives: its printed tags and the projected ones on it, as the camera
/// sees them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/targets/tag.hpp"

namespace afterglow::calib {

/// Corners in the photograph's pixels.
struct SeenTag : Tag {
  /// Of x0 y0 x1 y1 ... x3 y3, px^2: the corners of a tag come from one fit and err together.
  Eigen::Matrix<double, 8, 8> covariance = Eigen::Matrix<double, 8, 8>::Identity() * 0.0025;
};

struct View {
  std::string name;                ///< "view_03"
  std::vector<SeenTag> board;      ///< printed tags, ids of the board
  std::vector<SeenTag> projected;  ///< projected tags that lie on the board, ids of the pattern
  /// What is wrong with the photographs, each with an advice; a view with any is left out.
  std::vector<std::string> faults;
  /// What was seen and not used ("tags of the pattern on the floor: 12"), for the report.
  std::vector<std::string> notes;
};

}  // namespace afterglow::calib
