/// \file
/// The errors of a finished model in every view and corner, and of views that are predicted without
/// them (cross-validation): a calibration's evidence.
#pragma once

#include <optional>
#include <vector>

#include "calib/solver/calibration.hpp"
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

/// Compares a view with the finished model; `held_out`: the same view predicted without it.
ViewResult viewResult(const ProjectorModel& model, const ViewEvidence& view,
                      const std::optional<HeldOut>& held_out);
/// Returns the result of a view without a model: corners without errors.
ViewResult viewResult(const ViewEvidence& view);

/// The calibration's errors over all its used views; infinite where nothing was held out.
void setErrors(Calibration& calibration, const std::vector<std::optional<HeldOut>>& held_out);

}  // namespace afterglow::calib
