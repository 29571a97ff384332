/// \file
/// Cross-validation: each view is predicted by a calibration that was solved without it.
#pragma once

#include <optional>
#include <vector>

#include "calib/solver/refine.hpp"

namespace afterglow::calib {

struct HeldOut {
  double rms_px = 0;  ///< projector pixels
  double rms_mm = 0;  ///< on the board
  int corners = 0;
  ProjectorEstimate without;  ///< solved without the view; no covariance
};

/// For every used view, in order; empty for the others. The model is solved without the view, the
/// view's board pose comes from its printed tags alone, and its projected corners are compared.
/// Tags that are outliers in the full solution are left out here too.
std::vector<std::optional<HeldOut>> leaveOneOut(const ProjectorModel& model,
                                                const std::vector<ViewEvidence>& views,
                                                const RefineSettings& settings, int threads);

/// The factor by which the true variance of projected points exceeds the estimate's covariance: the
/// jackknife variance over views divided by the predicted variance, both averaged over the tags
/// seen; at least 1. Least squares takes tags for independent, but those of one view share a board
/// that is not quite flat, a focus, a light. Source: Efron and Stein, The Jackknife Estimate of
/// Variance, 1981.
double jackknifeInflation(const ProjectorEstimate& estimate, const std::vector<ViewEvidence>& views,
                          const std::vector<std::optional<HeldOut>>& held_out);

}  // namespace afterglow::calib
