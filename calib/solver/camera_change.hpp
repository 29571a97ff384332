/// \file
/// The camera's lens while the projector is calibrated: how far camera_infos are off as a rule, and
/// what the views say of the one that was given.
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
  double aspect = 0.001;  ///< of fx / fy
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

/// And what it exceeds once in a thousand times by chance.
struct ChiSquare {
  double value = 0, limit = 0;
};

/// By how much the views would have the camera be another than its camera_info says.
struct CameraChange {
  CameraFate fate = CameraFate::Held;
  double focal = 0;  ///< 0.002: the focal length is 0.2 % longer
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
  double largest_px = 0;  ///< what any place of the picture moves by, at most
  /// Of the views against camera_info, and against its distortion whatever its focal length and
  /// center are.
  ChiSquare contradiction, distortion_contradiction;

  /// Sets the amounts.
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
/// What became of the camera, in a sentence: "the camera was refined: focal length ...".
std::string cameraText(const CameraChange& change);
/// "focal length +0.20 %, center (+1.0, -0.9) px, up to 2.1 px in the picture"
std::string changeText(const CameraChange& change);
/// Empty, or that camera_info is not this camera's: nothing should be built on it.
std::vector<std::string> cameraRefusals(const Lens& given, const CameraChange& change);
/// Of amounts that are unusual, and of a camera held against what the views say.
std::vector<std::string> cameraWarnings(const Lens& given, const CameraChange& change);

}  // namespace afterglow::calib
