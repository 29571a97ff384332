/// \file
/// Joint robust least squares over projector, its pose and all boards (Ceres): bundle adjustment
/// with tags' corners, each tag weighted by the covariance of its fit.
#pragma once

#include <vector>

#include "calib/solver/calibration.hpp"
#include "calib/solver/camera_change.hpp"
#include "calib/solver/influence.hpp"
#include "calib/solver/refusals.hpp"
#include "calib/solver/tag_errors.hpp"

namespace afterglow::calib {

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
