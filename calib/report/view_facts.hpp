/// \file
/// The report's facts about one view beside its residuals.
#pragma once

#include <optional>
#include <string>

#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

struct ViewFacts {
  double distance_m = 0;  ///< distance from the projector's lens to the board's middle
  double tilt_deg = 0;    ///< angle between the board's normal and the projector's axis
  std::string turned;     ///< the direction of the board's face, seen from the projector: an arrow
  int outliers = 0;    ///< corners
  std::optional<double> training_mm;  ///< projected_rms_px as millimeters on the board
};

/// Returns the facts of a view with a pose (one that has residuals).
ViewFacts factsOf(const ViewResult& view, const ProjectorEstimate& estimate);

int usedViews(const Calibration& calibration);

}  // namespace afterglow::calib
