/// \file
/// Joint robust least squares over projector, its pose and all boards (Ceres): bundle adjustment
/// with tags' corners, each tag weighted by the covariance of its fit.
///
/// The errors of a model in the views, tag by tag, and their scales.
#pragma once

#include <optional>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/solver/board_shape.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/solver/camera_change.hpp"
#include "calib/solver/evidence.hpp"
#include "calib/solver/influence.hpp"
#include "calib/solver/refusals.hpp"

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

struct RefineSettings {
  bool free_skew = false;              ///< and the aspect ratio, otherwise known to be near 1
  bool free_rational = false;          ///< k4 k5 k6 too
  bool free_camera = false;            ///< true: camera_info and its usual deviations are a prior
  bool free_camera_distortion = true;  ///< if the camera is free at all
  bool free_shape = false;             ///< the board's, with usualShape as prior
  bool free_stretch = false;           ///< whatever printers usually do
  bool free_boards = true;
  bool use_projected = true;
  /// Tags beyond this many deviations count less and less (Cauchy).
  double robust_deviations = 4;
  int iterations = 30;
};

/// Improves model and board poses of the used views in place. Throws CalibrationRefused if the
/// solver finds no usable solution.
void refine(ProjectorModel& model, std::vector<ViewEvidence>& views,
            const RefineSettings& settings);

/// Returns the influence at the finished model.
Influence influenceOf(const ProjectorModel& model, std::vector<ViewEvidence>& views,
                      const RefineSettings& settings);
/// The model with its shared parameters moved.
ProjectorModel movedBy(const ProjectorModel& model, const SharedVector& by);

/// Returns the estimate of the finished model, with its covariance. Throws CalibrationRefused if
/// the views leave a parameter undetermined.
ProjectorEstimate estimateOf(const ProjectorModel& model, const Influence& influence,
                             double dispersion = 1);

/// Returns the covariance of the camera of a model that was refined with its camera free, the prior
/// included.
CameraMatrix cameraCovariance(const Influence& influence);

/// The board's pose from its printed tags alone.
void refineBoardPose(const ProjectorModel& model, ViewEvidence& view);

/// Estimates the stretch of the print from all printed tags. A free camera separates the stretch
/// from a camera_info of wrong aspect ratio as well as the views allow.
PrintStretch printStretch(const ProjectorModel& model, const std::vector<ViewEvidence>& views,
                          bool free_camera);

/// Aspect ratio and skew, solved free. With a free camera, small errors of camera_info are not
/// mistaken for them.
PixelShape pixelShape(const ProjectorModel& model, const std::vector<ViewEvidence>& views,
                      bool free_camera);

}  // namespace afterglow::calib
