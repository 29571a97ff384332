/// \file
/// How far a model is off what the views show, tag by tag, and how far errors may be off.
#pragma once

#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/solver/evidence.hpp"

namespace afterglow::calib {

/// What is solved for, and how the evidence is weighted.
struct ProjectorModel {
  Lens projector;  ///< K(0, 1) is the skew
  Rigid<Camera, Projector> T_camera_projector;
  Lens camera;
  Lens camera_info;  ///< the camera as given: what is known of it before
  /// Errors are this many times what the tags' own covariances say: cells are not painted by a
  /// mathematician. Estimated from the residuals.
  double printed_scale = 1, projected_scale = 1;
};

/// Errors of one tag's corners and the deviations they amount to.
struct TagError {
  Vector8 error;  ///< printed: camera px; projected: projector px. NaN if it cannot be computed.
  double deviations = 0;  ///< root mean square over the eight, in standard deviations of the fit
};
/// Too many deviations off to be believed.
bool isOutlier(const TagError& error);
TagError printedError(const ProjectorModel& model, const ViewEvidence& view, const Sighting& tag);
TagError projectedError(const ProjectorModel& model, const ViewEvidence& view, const Sighting& tag);

/// Of the tag's corners in projector pixels: its own covariance through the board's plane.
Matrix8 projectorCovariance(const ProjectorModel& model, const ViewEvidence& view,
                            const Sighting& tag);
/// Lower triangular W with W * covariance * W^T = 1.
Matrix8 whitening(const Matrix8& covariance);

/// Sets the scales from the residuals' middle, which outliers do not move: for weights.
void measureScales(ProjectorModel& model, const std::vector<ViewEvidence>& views);
/// Widens scales that have been measured to the root mean square of all but the outliers: for
/// covariances, since errors have heavier tails than a Gaussian of that middle.
void widenScales(ProjectorModel& model, const std::vector<ViewEvidence>& views);

}  // namespace afterglow::calib
