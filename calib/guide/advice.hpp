/// \file
/// What the views taken so far lack, and how the board has to be held to give it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

/// How far the board's face is turned away from the camera, as the camera sees it: x to the right,
/// y down; radians, zero where it looks straight into the lens.
Eigen::Vector2d boardTilt(const Rigid<Camera, Surface>& T_camera_board);

/// Left, right, up and down of tilts are the camera's, those of the light are the projector's
/// picture's. Most urgent first; empty if nothing lacks. `now`: where the board is held, if seen.
std::vector<std::string> adviceFor(const std::vector<Rigid<Camera, Surface>>& taken,
                                   const Coverage& coverage,
                                   const std::optional<Rigid<Camera, Surface>>& now);

/// No two of the boards are turned against each other by enough to tell a projector's lens from
/// them.
bool areParallel(const std::vector<Rigid<Camera, Surface>>& taken);

}  // namespace afterglow::calib
