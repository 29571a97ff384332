/// \file
/// The errors of a finished model in every view and corner: a calibration's evidence.
#pragma once

#include <optional>
#include <vector>

#include "calib/solver/calibration.hpp"
#include "calib/solver/cross_validation.hpp"
#include "calib/solver/refine.hpp"

namespace afterglow::calib {

/// Compares a view with the finished model; `held_out`: the same view predicted without it.
ViewResult viewResult(const ProjectorModel& model, const ViewEvidence& view,
                      const std::optional<HeldOut>& held_out);
/// Returns the result of a view without a model: corners without errors.
ViewResult viewResult(const ViewEvidence& view);

/// The calibration's errors over all its used views; infinite where nothing was held out.
void setErrors(Calibration& calibration, const std::vector<std::optional<HeldOut>>& held_out);

}  // namespace afterglow::calib
