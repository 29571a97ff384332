/// \file
/// The errors of a model in the views, tag by tag, and their scales.
#pragma once

#include <optional>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/solver/board_shape.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/solver/evidence.hpp"

namespace afterglow::calib {

/// The unknowns of the solver, and the weights of the evidence.
struct ProjectorModel {
  Lens projector;  ///< K(0, 1) is the skew
  Rigid<Camera, Projector> T_camera_projector;
  Lens camera;
  Lens camera_info;  ///< the camera as given: the prior
  BoardShape shape;
  std::optional<ProjectorEstimate> start;  ///< the projector's lens before: the prior
  /// The true errors divided by what the tags' own covariances predict: printed and projected cells
  /// are not ideal. Estimated from the residuals.
  double printed_scale = 1, projected_scale = 1;
};

/// Errors of one tag's corners and the deviations they amount to.
struct TagError {
  Vector8 error;  ///< printed: camera px; projected: projector px. NaN if it cannot be computed.
  double deviations = 0;  ///< root mean square over the eight, in standard deviations of the fit
};
/// Returns true if the error is more deviations than chance explains.
bool isOutlier(const TagError& error);
TagError printedError(const ProjectorModel& model, const ViewEvidence& view, const Sighting& tag);
TagError projectedError(const ProjectorModel& model, const ViewEvidence& view, const Sighting& tag);

/// Returns the covariance of the tag's corners in projector pixels: its own, through the board's
/// plane.
Matrix8 projectorCovariance(const ProjectorModel& model, const ViewEvidence& view,
                            const Sighting& tag);
/// Lower triangular W with W * covariance * W^T = 1.
Matrix8 whitening(const Matrix8& covariance);

/// Sets the scales from the residuals' median, which outliers do not move: for weights.
void measureScales(ProjectorModel& model, const std::vector<ViewEvidence>& views);
/// Widens measured scales to the root mean square of all but the outliers: for covariances, because
/// errors have heavier tails than a Gaussian of that median.
void widenScales(ProjectorModel& model, const std::vector<ViewEvidence>& views);

}  // namespace afterglow::calib
