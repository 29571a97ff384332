/// \file
/// A projector's or camera's lens: pinhole with any principal point, and Brown-Conrady distortion.
/// Source: OpenCV's camera model (calib3d, "Detailed Description"), REP 104 /
/// sensor_msgs/CameraInfo.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace afterglow::calib {

/// Valid once it comes from makeLens or a loader; the principal point may lie outside the image
/// (lens shift is normal for projectors).
struct Lens {
  int width = 0;                                    ///< px
  int height = 0;                                   ///< px
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();  ///< px; K(0,1) is the skew
  /// k1 k2 p1 p2 k3 k4 k5 k6 (OpenCV's order): plumb_bob uses the first five, rational_polynomial
  /// all eight.
  std::array<double, 8> D{};
  /// foldRadius of D; makeLens computes it once.
  double fold_radius = std::numeric_limits<double>::infinity();
};

/// What is wrong with the values, all of it: size, focal lengths, K's form, how many D there are
/// (0, 4, 5 or 8), numbers that are not finite. Empty if nothing is.
std::vector<std::string> lensViolations(int width, int height, const Eigen::Matrix3d& K,
                                        const std::vector<double>& D);

/// Throws std::invalid_argument that lists every violation.
Lens makeLens(int width, int height, const Eigen::Matrix3d& K, const std::vector<double>& D);

/// Largest undistorted radius (x^2 + y^2)^(1/2) / z up to which the radial distortion still grows;
/// beyond it the model folds back into the image and is not used. Infinity without a fold.
double foldRadius(const Lens& lens);

/// Normalized image coordinates (z = 1) after distortion, of those before. Knows of no fold.
Eigen::Vector2d distort(const Lens& lens, const Eigen::Vector2d& undistorted);

/// Pixel of a point in the optical frame (meters). Empty if it is not in front of the lens (z <= 0)
/// or lies beyond the fold. May lie outside the image; the caller clips. Pure.
std::optional<Eigen::Vector2d> project(const Lens& lens, const Eigen::Vector3d& p_optical);

/// Direction (x, y, 1) in the optical frame of the ray through a pixel: the inverse of project, by
/// Newton's method to 1e-12. Empty if no ray within the fold reaches the pixel.
std::optional<Eigen::Vector3d> unproject(const Lens& lens, const Eigen::Vector2d& pixel);

}  // namespace afterglow::calib
