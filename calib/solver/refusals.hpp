/// \file
/// The reasons why views cannot be calibrated from, or a result cannot be trusted. All functions
/// are pure and return one line for each reason, with an advice; no line if all is well.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/solver/refusals.hpp"

namespace afterglow::calib {

/// A view fit for use.
struct PosedView {
  std::string name;
  Rigid<Camera, Surface> T_camera_board;
  /// The corners of the pattern's tags seen on the board, in the projector's pixels.
  std::vector<Eigen::Vector2d> lit_px;

  /// The board's normal in the camera frame.
  Eigen::Vector3d normal() const { return T_camera_board.matrix().linear().col(2); }
};

/// Refuses before solving: fewer than three views, boards (nearly) parallel, an implausible
/// distance, too few corners, corners in a part of the projector's picture only (the empty sides
/// are named).
std::vector<std::string> viewRefusals(const std::vector<PosedView>& views, const Board& board,
                                      const Pattern& pattern);
/// The same of views that refine a calibration, which need not cover the picture again.
std::vector<std::string> refiningRefusals(const std::vector<PosedView>& views, const Board& board);

/// Standard deviations of what a projector's lens does when it warms up or is bumped, as shares of
/// the focal length, of fx / fy and of the picture's width.
struct LensDrift {
  static constexpr double kFocal = 0.003, kAspect = 0.0002, kCenter = 0.003;
};
/// Refuses a lens that changed by more than LensDrift since.
std::vector<std::string> driftRefusals(const Lens& before, const Lens& now);

/// Refuses after solving, by the predicted error (the larger half axis of the 95 % ellipse,
/// projector pixels) of the corners on the boards; too large when the views leave something open
/// that no check above has a name for.
std::vector<std::string> uncertaintyRefusals(const ProjectorEstimate& estimate,
                                             const std::vector<PosedView>& views);
/// The 95th percentile of that half axis over the corners; and the same in millimeters where the
/// corner's light falls on its board, held square to it. Infinity without predictions.
struct PredictedError {
  double px = 0, mm = 0;
};
PredictedError predictedError(const ProjectorEstimate& estimate,
                              const std::vector<PosedView>& views);

/// Aspect ratio and skew of a solution with K(0, 1) and fx / fy free, with their deviations.
///
/// Projectors have square pixels and no skew. Keystone correction puts a homography between pattern
/// and lens, and any homography times K is again an upper triangular matrix times a rotation: it
/// shows only as aspect ratio, skew and place of the principal point, whatever the board (an ideal
/// keystone correction equals a lens shift, and is as harmless). A warp that is no homography
/// (corner or curve correction) shows as a misfit.
struct PixelShape {
  double aspect = 1, aspect_sigma = 0;      ///< fx / fy
  double skew_rad = 0, skew_sigma_rad = 0;  ///< atan(K(0, 1) / fy): columns lean by this much
};
std::vector<std::string> pixelShapeRefusals(const PixelShape& shape, const Lens& projector);

/// Refuses a held-out error (projector pixels) far above the accuracy of the corners.
std::vector<std::string> misfitRefusals(double held_out_rms_px, const Lens& projector);

std::vector<std::string> foldRefusals(const Lens& projector);

/// The surplus of the printed board's width for its height: 0.01 is one percent.
struct PrintStretch {
  double stretch = 0, sigma = 0;
};
/// `measured_ruler_m`: the length of the printed ruler as the user measured it. Only this tells
/// that a print is too large or too small as a whole: images cannot tell it from a true board
/// further off.
std::vector<std::string> printRefusals(const Board& board, const std::optional<PrintStretch>& seen,
                                       const std::optional<double>& measured_ruler_m);

/// The part of the projector's image that the views cover, as far as the camera sees that image.
/// Cell by cell as in Coverage; a cell is in reach if its light, at the boards' middle distance,
/// falls where the camera sees it and the pattern has corners in it.
struct Reach {
  double covered = 0;  ///< share of the cells in reach that have corners, 0 to 1
  /// left, right, upper, lower: thirds of the part in reach in which there are no corners.
  std::vector<std::string> empty_sides;
};
Reach reachOf(const ProjectorEstimate& estimate, const Lens& camera, const Pattern& pattern,
              const std::vector<PosedView>& views);

/// Refuses if nearly all of the part in reach was never lit on a board.
std::vector<std::string> reachRefusals(const Reach& reach);
/// The parts that will be uncertain: "nothing was seen in the right third of ...".
std::vector<std::string> reachWarnings(const Reach& reach);

}  // namespace afterglow::calib
