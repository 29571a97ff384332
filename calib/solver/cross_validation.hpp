/// \file
/// Cross-validation: each view is predicted by a calibration that was solved without it.
#pragma once

#include <optional>
#include <vector>

#include "calib/solver/refine.hpp"

namespace afterglow::calib {

struct HeldOut {
  double rms_px = 0;  ///< projector pixels
  double rms_mm = 0;  ///< error on the board
  int corners = 0;
};

/// Returns an error for every used view, in order; empty for the others. Projector, camera and
/// board's shape are solved without the view (to first order: no view moves them far), its board's
/// pose comes from its printed tags alone, and its projected corners are compared. Tags that are
/// outliers in the full solution are left out here too.
std::vector<std::optional<HeldOut>> leaveOneOut(const ProjectorModel& model,
                                                const std::vector<ViewEvidence>& views,
                                                const Influence& influence, int threads);

}  // namespace afterglow::calib
