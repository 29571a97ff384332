/// \file
/// The lens of a projector or camera: a pinhole with any principal point, and its distortion.
/// Source: OpenCV's camera models (calib3d, "Detailed Description", and cv::fisheye), REP 104 /
/// sensor_msgs/CameraInfo, sensor_msgs/distortion_models.h.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace afterglow::calib {

// The formulas of distortion, for doubles and for the floats of a drawing's inner loops; once more
// in shaders/lens.glsl.

/// Brown-Conrady's radial factor, by the squared radius.
template <typename Number>
Number radialFactor(const std::array<Number, 8>& D, Number s) {
  return (1 + s * (D[0] + s * (D[1] + s * D[4]))) / (1 + s * (D[5] + s * (D[6] + s * D[7])));
}
/// Moves x and y by a radial factor and by p1 and p2.
template <typename Number>
std::array<Number, 2> distorted(Number x, Number y, Number factor, Number p1, Number p2) {
  const Number s = x * x + y * y;
  return {factor * x + (2 * p1 * x * y + p2 * (s + 2 * x * x)),
          factor * y + (p1 * (s + 2 * y * y) + 2 * p2 * x * y)};
}
/// Kannala-Brandt's distorted radius, by the ray's angle to the axis in radians.
template <typename Number>
Number equidistantRadius(const std::array<Number, 8>& D, Number angle) {
  const Number s = angle * angle;
  return angle * (1 + s * (D[0] + s * (D[1] + s * (D[2] + s * D[3]))));
}

enum class LensModel {
  BrownConrady,  ///< ROS: plumb_bob and rational_polynomial
  Equidistant,   ///< Kannala-Brandt, fisheye lenses; ROS: equidistant
};

/// Valid once it comes from makeLens or a loader; the principal point may lie outside the image
/// (lens shift is normal for projectors).
struct Lens {
  int width = 0;                                    ///< px
  int height = 0;                                   ///< px
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();  ///< px; K(0,1) is the skew
  /// k1 k2 p1 p2 k3 k4 k5 k6 (OpenCV's order): plumb_bob uses the first five, rational_polynomial
  /// all eight. Equidistant: k1 k2 k3 k4.
  std::array<double, 8> D{};
  /// foldRadius of D; makeLens computes it once.
  double fold_radius = std::numeric_limits<double>::infinity();
  LensModel model = LensModel::BrownConrady;
};

/// The model that ROS calls so: plumb_bob, rational_polynomial, equidistant, or fisheye, as
/// camera_calibration called the last one up to Melodic. Empty for any other name.
std::optional<LensModel> lensModelNamed(const std::string& distortion_model);
/// Returns ROS's name of this lens's distortion_model, and its D there: 5, 8 or 4 numbers.
std::string distortionModel(const Lens& lens);
std::vector<double> distortionCoefficients(const Lens& lens);

/// Returns all that is wrong with the values: size, focal lengths, K's form, how many D there are
/// (0, 4, 5 or 8; equidistant: 4), numbers that are not finite. Empty if nothing is.
std::vector<std::string> lensViolations(int width, int height, const Eigen::Matrix3d& K,
                                        const std::vector<double>& D,
                                        LensModel model = LensModel::BrownConrady);

/// Throws std::invalid_argument that lists every violation.
Lens makeLens(int width, int height, const Eigen::Matrix3d& K, const std::vector<double>& D,
              LensModel model = LensModel::BrownConrady);

/// Largest undistorted radius (x^2 + y^2)^(1/2) / z up to which the radial distortion still grows;
/// beyond it the model folds back into the image and is not used. Infinity without a fold, and for
/// an equidistant lens 100: rays of 90 degrees and more have no place at z = 1, 89.4 are used.
double foldRadius(const Lens& lens);

/// Turns undistorted into distorted normalized image coordinates (z = 1). Ignores the fold.
Eigen::Vector2d distort(const Lens& lens, const Eigen::Vector2d& undistorted);

/// The pixel of a ray (x, y, 1), with its derivatives by the ray and by the lens: fx, fy, cx, cy,
/// skew, then D. Ignores the fold.
struct PixelSlope {
  Eigen::Vector2d pixel;
  Eigen::Matrix2d by_ray;
  Eigen::Matrix<double, 2, 13> by_lens;
};
PixelSlope pixelSlope(const Lens& lens, const Eigen::Vector2d& ray);

/// Pixel of a point in the optical frame (meters). Empty if it is not in front of the lens (z <= 0)
/// or lies beyond the fold. May lie outside the image; the caller clips. Pure.
std::optional<Eigen::Vector2d> project(const Lens& lens, const Eigen::Vector3d& p_optical);

/// Direction (x, y, 1) in the optical frame of the ray through a pixel: the inverse of project, by
/// Newton's method to 1e-12. Empty if no ray within the fold reaches the pixel.
std::optional<Eigen::Vector3d> unproject(const Lens& lens, const Eigen::Vector2d& pixel);

/// The ray of each pixel, found faster than by unproject: the lens is inverted once, on a grid of
/// points 4 px apart, and interpolated bilinearly between them. Off by less than 0.001 px for k1 =
/// -0.35.
class RayMap {
 public:
  explicit RayMap(const Lens& lens);

  /// Normalized undistorted coordinates (z = 1) of a pixel; NaN where no ray leads. The pixel may
  /// lie up to 4 px outside the image.
  Eigen::Vector2d ray(const Eigen::Vector2d& pixel) const;

 private:
  int columns_, rows_;
  std::vector<Eigen::Vector2d> rays_;
};

/// The numbers of D that this distortion_model has: plumb_bob 5, rational_polynomial 8, equidistant
/// and fisheye 4, others all. Drivers send more (OpenCV's 14), which must be 0. Throws
/// std::invalid_argument, without a key: one of them is not, or there are too few (plumb_bob may
/// have 4 or none).
std::vector<double> usedDistortion(const std::string& distortion_model, std::vector<double> D);

}  // namespace afterglow::calib
