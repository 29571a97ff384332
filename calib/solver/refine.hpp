/// \file
/// Joint robust least squares over projector, its pose and all boards (Ceres): bundle adjustment
/// with tags' corners, each tag weighted by the covariance of its fit.
#pragma once

#include <array>
#include <vector>

#include "calib/solver/calibration.hpp"
#include "calib/solver/evidence.hpp"
#include "calib/solver/refusals.hpp"

namespace afterglow::calib {

/// What is solved for, and how the evidence is weighted.
struct ProjectorModel {
  Lens projector;  ///< K(0, 1) is the skew
  Rigid<Camera, Projector> T_camera_projector;
  Lens camera;
  /// Errors are this many times what the tags' own covariances say: cells are not painted by a
  /// mathematician. Estimated from the residuals.
  double printed_scale = 1, projected_scale = 1;
};

struct RefineSettings {
  bool free_skew = false;      ///< and the aspect ratio, otherwise known to be near 1
  bool free_rational = false;  ///< k4 k5 k6 too
  bool free_camera = false;
  bool free_boards = true;
  /// Tags beyond this many deviations count less and less (Cauchy).
  double robust_deviations = 4;
  int iterations = 30;
};

/// Improves model and board poses of the used views in place. Returns the covariance of the
/// calibration's parameters if `covariance` is set. Throws CalibrationRefused if the problem has no
/// single solution.
void refine(ProjectorModel& model, std::vector<ViewEvidence>& views,
            const RefineSettings& settings);

/// Of the finished model, in the order of kCalibrationParameters.
ProjectorEstimate estimateOf(const ProjectorModel& model, std::vector<ViewEvidence>& views,
                             const RefineSettings& settings);

/// The board's pose from its printed tags alone.
void refineBoardPose(const ProjectorModel& model, ViewEvidence& view);

/// How much the print is stretched, from all printed tags.
PrintStretch printStretch(const ProjectorModel& model, const std::vector<ViewEvidence>& views);

/// Aspect and skew, solved free.
PixelShape pixelShape(const ProjectorModel& model, const std::vector<ViewEvidence>& views);

/// Sets the scales from the residuals' middle, which outliers do not move: for weights.
void measureScales(ProjectorModel& model, const std::vector<ViewEvidence>& views);
/// Widens scales that have been measured to the root mean square of all but the outliers: for
/// covariances, since errors have heavier tails than a Gaussian of that middle.
void widenScales(ProjectorModel& model, const std::vector<ViewEvidence>& views);

/// Errors of one tag's corners and the deviations they amount to.
struct TagError {
  Vector8 error;  ///< printed: camera px; projected: projector px. NaN if it cannot be computed.
  double deviations = 0;  ///< root mean square over the eight, in standard deviations of the fit
};
/// Too many deviations off to be believed.
bool isOutlier(const TagError& error);
TagError printedError(const ProjectorModel& model, const ViewEvidence& view, const Sighting& tag);
TagError projectedError(const ProjectorModel& model, const ViewEvidence& view, const Sighting& tag);

}  // namespace afterglow::calib
