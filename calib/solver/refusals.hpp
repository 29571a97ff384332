/// \file
/// When a set of views cannot be calibrated from, or a result cannot be trusted: each with a reason
/// and an advice, one line. All functions are pure and return what is wrong, nothing if all is
/// well.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

/// A view fit for use.
struct PosedView {
  std::string name;
  Rigid<Camera, Surface> T_camera_board;
  /// The corners of the pattern's tags seen on the board, in the projector's pixels.
  std::vector<Eigen::Vector2d> lit_px;

  /// The board's, in the camera frame.
  Eigen::Vector3d normal() const { return T_camera_board.matrix().linear().col(2); }
};

/// Before solving: fewer than three views, boards (nearly) parallel, an implausible distance, too
/// few corners, corners in a part of the projector's picture only (the empty sides are named).
std::vector<std::string> viewRefusals(const std::vector<PosedView>& views, const Board& board,
                                      const Pattern& pattern);

/// After solving: the predicted error (the larger half axis of the 95 % ellipse, projector pixels)
/// of the corners on the boards; too large when the views leave something open that no check above
/// has a name for.
std::vector<std::string> uncertaintyRefusals(const ProjectorEstimate& estimate,
                                             const std::vector<PosedView>& views);
/// The 95th percentile over the corners of that half axis, and of what it is in millimeters where
/// the corner's light falls on its board, held square to it. Infinity where nothing is predicted.
struct PredictedError {
  double px = 0, mm = 0;
};
PredictedError predictedError(const ProjectorEstimate& estimate,
                              const std::vector<PosedView>& views);

/// What a solution with K(0, 1) and fx / fy free finds, and how surely.
///
/// Projectors have square pixels and no skew. Keystone correction puts a homography between pattern
/// and lens, and any homography times K is again an upper triangular matrix times a rotation: all
/// that is left to see of it, whatever the board, is aspect ratio, skew and the place of the
/// principal point (an ideal keystone correction is the same as a lens shift, and as harmless).
/// A warp that is no homography (corner or curve correction) shows as a misfit.
struct PixelShape {
  double aspect = 1, aspect_sigma = 0;      ///< fx / fy
  double skew_rad = 0, skew_sigma_rad = 0;  ///< atan(K(0, 1) / fy): columns lean by this much
};
std::vector<std::string> pixelShapeRefusals(const PixelShape& shape, const Lens& projector);

/// Held-out error (projector pixels) far above what corners can be seen with.
std::vector<std::string> misfitRefusals(double held_out_rms_px, const Lens& projector);

/// Share of the picture (0 to 1) that no ray within the lens model's fold reaches.
double foldedShare(const Lens& lens);
std::vector<std::string> foldRefusals(const Lens& projector);

/// How much wider the printed board is than it should be for its height: 0.01 is one per cent.
struct PrintStretch {
  double stretch = 0, sigma = 0;
};
/// `measured_ruler_m`: what the user measured the printed ruler to be. It alone tells a print that
/// is too large or too small as a whole: pictures of it are those of a true one further off.
std::vector<std::string> printRefusals(const Board& board, const std::optional<PrintStretch>& seen,
                                       const std::optional<double>& measured_ruler_m);

}  // namespace afterglow::calib
