/// \file
/// The views that are still missing, and how the board has to be held for them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

/// Returns how far the board's face is turned away from the camera, as the camera sees it: x to the
/// right, y down; radians, zero where it looks straight into the lens.
Eigen::Vector2d boardTilt(const Rigid<Camera, Surface>& T_camera_board);

/// Tilts are named as the camera sees them (left, right, up, down), places in the light as they are
/// in the projector's image. Most urgent first; empty if nothing is missing. `now`: where the board
/// is held, if it is seen.
std::vector<std::string> adviceFor(const std::vector<Rigid<Camera, Surface>>& taken,
                                   const Coverage& coverage,
                                   const std::optional<Rigid<Camera, Surface>>& now);

/// Returns true if all boards are so nearly parallel that the projector's lens cannot be told from
/// them.
bool areParallel(const std::vector<Rigid<Camera, Surface>>& taken);

}  // namespace afterglow::calib
