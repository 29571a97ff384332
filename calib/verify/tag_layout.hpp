/// \file
/// Tags at known places of a floor or a table.
#pragma once

#include <string>
#include <vector>

#include "calib/targets/tag.hpp"

namespace afterglow::calib {

/// Corners in meters on the z = 0 plane of `frame` (x and y as on a board: turned from x to y is
/// counterclockwise for who looks down on it).
struct TagLayout {
  std::string frame;  ///< tf; may be empty where no tf is asked
  std::string family = "tag36h11";
  std::vector<Tag> tags;     ///< printed, lying there
  std::vector<Tag> targets;  ///< where tags of light shall fall; may be empty
};

/// Of a square tag whose upright picture is turned counterclockwise by `yaw`.
Tag squareTag(int id, const Eigen::Vector2d& center, double side_m, double yaw_rad);

/// The place that is the tag's middle in any perspective: where the diagonals meet.
Eigen::Vector2d middleOf(const Tag& tag);

/// Whether two tags, each with the white rim of a cell that it needs, overlap.
bool areTooClose(const Tag& a, const Tag& b);

}  // namespace afterglow::calib
