/// \file
/// A finished calibration against fresh photographs of the board, in millimeters on the board.
#pragma once

#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/landing.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

struct ViewCheck {
  std::string name;
  std::vector<LandingError> errors;  ///< `wanted`: where the calibration says that light lands
  std::string fault;                 ///< reason if nothing was measured
};

/// The board's pose comes from its printed tags alone, so that the projector's calibration has no
/// say in where the light is. Never throws for what a view lacks.
ViewCheck checkView(const View& view, const Board& board, const Pattern& pattern,
                    const Lens& camera, const ProjectorEstimate& estimate);

}  // namespace afterglow::calib
