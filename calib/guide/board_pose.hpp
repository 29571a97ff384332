/// \file
/// Where the board is held, from its printed tags in one frame.
#pragma once

#include <optional>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {

/// Tags of other ids, and ids seen more than once, are left out. Empty with fewer than two tags,
/// where the lens has no ray for a corner, or if the board would face away from the camera. Pure.
std::optional<Rigid<Camera, Surface>> boardPose(const std::vector<Tag>& seen, const Board& board,
                                                const Lens& camera);

/// How far the board's face is turned away from the camera, as the camera sees it: x to the right,
/// y down; radians, zero where it looks straight into the lens.
Eigen::Vector2d boardTilt(const Rigid<Camera, Surface>& T_camera_board);

}  // namespace afterglow::calib
