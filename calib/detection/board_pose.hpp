/// \file
/// The pose of a flat board, or of any surface with printed tags, by its tags in one photograph.
#pragma once

#include <optional>
#include <set>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {

struct BoardPose {
  Rigid<Camera, Surface> T_camera_board;
  std::set<int> ids;  ///< the tags it is from: those that lie as `printed` has them
};

/// `seen`: corners in the photograph's pixels; ids that are not among `printed` (meters, z = 0) or
/// are seen more than once are left out, and so are tags more than 3 px off where the others put
/// them. Empty if fewer than two tags agree, or if the board would face away from the camera. Pure.
std::optional<BoardPose> boardPose(const std::vector<Tag>& seen, const std::vector<Tag>& printed,
                                   const Lens& camera);

}  // namespace afterglow::calib
