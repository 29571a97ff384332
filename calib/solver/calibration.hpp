/// \file
/// A projector's calibration with its evidence: the result of the solver, in files and report.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/solver/board_shape.hpp"
#include "calib/solver/camera_change.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

/// Order of the parameters a covariance is about: fx fy cx cy (px), k1 k2 p1 p2 k3 k4 k5 k6 as in
/// Lens::D, then the rotation vector (rad, in the projector's frame: T_camera_projector * exp(w))
/// and the translation (m, in the camera's frame) of T_camera_projector.
constexpr int kCalibrationParameters = 18;

struct ProjectorEstimate {
  Lens projector;
  Rigid<Camera, Projector> T_camera_projector;
  /// Rows of what was held fixed are zero.
  Eigen::Matrix<double, kCalibrationParameters, kCalibrationParameters> covariance =
      Eigen::Matrix<double, kCalibrationParameters, kCalibrationParameters>::Zero();
};

/// The pixel whose light meets a point, and its uncertainty.
struct PredictedPixel {
  Eigen::Vector2d pixel;
  Eigen::Matrix2d covariance;  ///< px^2, of the calibration alone
};
/// Empty if the projector cannot light the point (behind it, beyond the fold).
std::optional<PredictedPixel> predictPixel(const ProjectorEstimate& estimate,
                                           const Eigen::Vector3d& p_camera);

/// d pixel / d parameters, in the covariance's order; zero for those held fixed. Empty as above.
std::optional<Eigen::Matrix<double, 2, kCalibrationParameters>> pixelSlopes(
    const ProjectorEstimate& estimate, const Eigen::Vector3d& p_camera);

/// The bound of light's error at a distance along the projector's axis.
struct LightError {
  double distance_m = 0;
  double mm = 0, px = 0;
  /// The same of the best estimate that the noise of the views' corners permits (Cramer and Rao):
  /// what more exact corners or more views alone would make smaller.
  double bound_mm = 0;
};

/// The difference between one corner of a projected or printed tag and where the calibration
/// expects it.
struct CornerResidual {
  int tag_id = 0;
  int corner = 0;
  bool is_projected = true;
  Eigen::Vector2d camera_px;  ///< place in the photograph
  Eigen::Vector2d error_px;   ///< seen minus expected, in the photograph's pixels
  Eigen::Vector2d pattern_px = Eigen::Vector2d::Zero();  ///< the corner in the projector's picture
  Eigen::Vector2d pattern_error_px =
      Eigen::Vector2d::Zero();  ///< place in projector pixels; projected only
  bool is_outlier = false;
};

struct ViewResult {
  std::string name;
  bool is_used = false;
  std::string reason;  ///< the reason why the view is not used, with an advice; empty if it is
  Rigid<Camera, Surface> T_camera_board;
  std::vector<CornerResidual> residuals;
  double projected_rms_px = 0;  ///< projector pixels, training
  /// Root mean square of the projected corners' errors when the calibration is solved without this
  /// view: projector pixels, and millimeters on the board. Empty if the view is not used.
  std::optional<double> held_out_px, held_out_mm;
};

/// Counts of the tag corners on boards that have been seen in each cell of the projector's image.
struct Coverage {
  static constexpr int kColumns = 16, kRows = 10;
  std::vector<int> corners = std::vector<int>(kColumns * kRows, 0);  ///< row-major counts
  int possible = kColumns * kRows;  ///< cells in which the pattern has corners at all
  double share() const;             ///< the share of the possible cells that have a count, 0 to 1
};
Coverage coverageOf(const std::vector<Eigen::Vector2d>& corners_px, const Pattern& pattern);
Coverage coverageOf(const std::vector<View>& views, const Pattern& pattern);

struct Calibration {
  ProjectorEstimate estimate;
  /// Bounds at 1, 2 and 3 m: with a certainty of 95 %, 95 % of the light that the camera can see is
  /// closer than this to its place; camera and shape of the board are included, their print's size
  /// is not.
  std::vector<LightError> light;
  double print_mm_per_permille = 0;  ///< error of light for each 0.1 % of the print's size
  Lens camera;                       ///< the camera as it was used: as given, or refined
  Lens camera_info;                  ///< the camera as given
  CameraChange camera_change;
  BoardShape board_shape;
  std::vector<ViewResult> views;
  Coverage coverage;
  double held_out_rms_px = 0, held_out_rms_mm = 0;  ///< the headline, over all used views
  double training_rms_px = 0;
  double board_rms_px = 0;  ///< printed corners, camera pixels
  /// The error of light on the boards that the covariance predicts for 95 % of the corners, at 95 %
  /// certainty; includes the camera's lens, unless that was held.
  double predicted_mm = 0;
  std::vector<std::string> warnings;
};

/// "Light is off by at most 0.02 mm at 1 m, 0.04 mm at 2 m, 0.07 mm at 3 m (95 %), and by ...";
/// empty if nobody knows.
std::string lightText(const Calibration& calibration);

/// The views cannot be calibrated from. Each reason is one line, with an advice; what() joins them.
class CalibrationRefused : public std::runtime_error {
 public:
  explicit CalibrationRefused(const std::vector<std::string>& reasons);
  /// Keeps the results of the views as far as they are known.
  CalibrationRefused(const std::vector<std::string>& reasons, std::vector<ViewResult> views);
  /// The reasons, one line each.
  const std::vector<std::string>& reasons() const { return reasons_; }
  const std::vector<ViewResult>& views() const { return views_; }

 private:
  std::vector<std::string> reasons_;
  std::vector<ViewResult> views_;
};

/// Called with the present step of the work, and the share of the work that is done, 0 to 1.
using CalibrationProgress = std::function<void(const std::string& doing, double share)>;

}  // namespace afterglow::calib
