/// \file
/// The printed calibration board: tags round the rim, a free white middle for the projected ones.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/targets/tag.hpp"

namespace afterglow::calib {

/// Board frame (tag `Surface` of calib/frames.hpp): origin in the board's middle, x right, y up, z
/// out of the paper towards the viewer; meters.
struct Board {
  std::string family = "tag36h11";
  Eigen::Vector2d size_m = Eigen::Vector2d::Zero();  ///< the sheet
  std::vector<Tag> tags;                             ///< corners in meters
  double ruler_m = 0;  ///< length of the ruler printed on it, to check the print with; 0: none
};

/// Ids of a board are below this, those of a pattern from this on.
constexpr int kFirstPatternId = 100;

/// A board for a sheet: tags as large as five and a quarter of them fit the shorter side. Throws
/// std::invalid_argument for a sheet below 0.1 m or above 5 m a side, or so narrow that there is
/// no free middle or there are not enough ids.
Board makeBoard(const Eigen::Vector2d& size_m, const std::string& family = "tag36h11");

}  // namespace afterglow::calib
