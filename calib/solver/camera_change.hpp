/// \file
/// The camera's lens while the projector is calibrated: the usual errors of camera_infos, and how
/// far the views contradict the one that was given.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "calib/lens.hpp"

namespace afterglow::calib {

/// Standard deviations of a camera_info that somebody calibrated with care, a while ago.
struct CameraDeviations {
  double focal = 0.004;   ///< share of the focal length, both alike
  double aspect = 0.001;  ///< deviation of fx / fy
  double center_px = 0;
  std::array<double, 4> D{};  ///< k1 k2 p1 p2; equidistant: k1 k2 k3 k4
};
CameraDeviations usualDeviations(const Lens& camera);

/// fx fy cx cy and four of D: what is estimated of a camera.
constexpr int kCameraParameters = 8;
using CameraVector = Eigen::Matrix<double, kCameraParameters, 1>;
using CameraMatrix = Eigen::Matrix<double, kCameraParameters, kCameraParameters>;

enum class CameraFate {
  Agrees,   ///< camera_info stands: the views do not contradict it
  Refined,  ///< estimated anew, with camera_info as prior
  Held      ///< camera_info stands because that was asked for
};

/// A chi-square statistic, and the limit that chance exceeds once in a thousand times.
struct ChiSquare {
  double value = 0, limit = 0;
};

/// The difference between the camera that fits the views and its camera_info.
struct CameraChange {
  CameraFate fate = CameraFate::Held;
  double focal = 0;  ///< 0.002: the focal length is 0.2 % longer
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
  double largest_px = 0;  ///< the largest shift of any place of the image
  /// Contradictions between the views and camera_info; and between the views and the distortion of
  /// camera_info alone, with focal length and center free.
  ChiSquare contradiction, distortion_contradiction;

  /// Sets focal, center_px and largest_px.
  void describe(const Lens& given, const Lens& refined);
  bool isContradicted() const { return contradiction.value > contradiction.limit; }
  bool isDistortionContradicted() const {
    return distortion_contradiction.value > distortion_contradiction.limit;
  }
};

/// `covariance`: of the refined camera's parameters, its prior included.
CameraChange cameraChange(const Lens& given, const Lens& refined, const CameraMatrix& covariance);

/// agrees, refined, held
std::string fateName(CameraFate fate);
/// The fate of the camera, in a sentence: "the camera was refined: focal length ...".
std::string cameraText(const CameraChange& change);
/// Empty, or the reason why camera_info cannot be this camera's.
std::vector<std::string> cameraRefusals(const Lens& given, const CameraChange& change);
/// Unusual changes, and a camera that was held although the views contradict it.
std::vector<std::string> cameraWarnings(const Lens& given, const CameraChange& change);

}  // namespace afterglow::calib
