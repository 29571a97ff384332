/// \file
/// The solver's cost functions, as Ceres differentiates them; only for the solver's own sources.
/// The costs keep pointers to their tags.
#pragma once

#include <ceres/rotation.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cmath>

#include "calib/solver/camera_change.hpp"
#include "calib/solver/evidence.hpp"

namespace afterglow::calib {

// Blocks of parameters as Ceres has them.
constexpr int kLensSize = 13;  // fx fy cx cy skew, then D
constexpr int kPoseSize = 6;   // rotation vector, translation
using LensBlock = std::array<double, kLensSize>;
using PoseBlock = std::array<double, kPoseSize>;

/// OpenCV's camera model on z = 1 coordinates. The lens may be known (doubles) where the point is
/// not.
template <typename L, typename T>
void distortT(const L* D, const T& x, const T& y, T* dx, T* dy) {
  const T s = x * x + y * y;
  const T radial =
      (1.0 + s * (D[0] + s * (D[1] + s * D[4]))) / (1.0 + s * (D[5] + s * (D[6] + s * D[7])));
  *dx = x * radial + 2.0 * D[2] * x * y + D[3] * (s + 2.0 * x * x);
  *dy = y * radial + D[2] * (s + 2.0 * y * y) + 2.0 * D[3] * x * y;
}

/// cv::fisheye's: D is k1 to k4.
template <typename L, typename T>
void distortFisheyeT(const L* D, const T& x, const T& y, T* dx, T* dy) {
  using std::atan;
  using std::sqrt;
  const T s = x * x + y * y;
  *dx = x;
  *dy = y;
  if (s < 1e-16) return;  // where the root has no derivative
  const T r = sqrt(s), angle = atan(r), t = angle * angle;
  const T scale = angle * (1.0 + t * (D[0] + t * (D[1] + t * (D[2] + t * D[3])))) / r;
  *dx *= scale;
  *dy *= scale;
}

template <typename L, typename T>
void projectT(const L* lens, const T& x, const T& y, T* u, T* v,
              LensModel model = LensModel::BrownConrady) {
  T dx, dy;
  if (model == LensModel::Equidistant) {
    distortFisheyeT(lens + 5, x, y, &dx, &dy);
  } else {
    distortT(lens + 5, x, y, &dx, &dy);
  }
  *u = lens[0] * dx + lens[4] * dy + lens[2];
  *v = lens[1] * dy + lens[3];
}

/// A Jet's value without its derivatives.
inline double valueOf(double value) { return value; }
template <int kSize>
double valueOf(const ceres::Jet<double, kSize>& value) {
  return value.a;
}

/// The undistorted coordinates of distorted ones, as numbers: by fixed-point iteration, which
/// converges for every lens whose image does not fold, for fisheyes by Newton's in the angle.
inline Eigen::Vector2d undistorted(const double* D, const Eigen::Vector2d& distorted,
                                   LensModel model) {
  constexpr int kBrownSteps = 25, kFisheyeSteps = 10;
  if (model == LensModel::Equidistant) {
    const double radius = distorted.norm();
    if (radius < 1e-8) return distorted;
    double angle = radius;
    for (int i = 0; i < kFisheyeSteps; ++i) {
      const double t = angle * angle;
      const double error = angle * (1 + t * (D[0] + t * (D[1] + t * (D[2] + t * D[3])))) - radius;
      angle -= error / (1 + t * (3 * D[0] + t * (5 * D[1] + t * (7 * D[2] + t * 9 * D[3]))));
    }
    return distorted * std::tan(angle) / radius;
  }
  Eigen::Vector2d point = distorted, image;
  for (int i = 0; i < kBrownSteps; ++i) {
    distortT(D, point.x(), point.y(), &image.x(), &image.y());
    point -= image - distorted;
  }
  return point;
}

/// Inverse of projectT. First without derivatives; then one Newton step with derivatives, which by
/// the implicit function theorem gives exactly the derivatives of the inverse. Iterating with
/// derivatives would cost 25 times as much.
template <typename T>
void unprojectT(const T* lens, double u, double v, LensModel model, T* x, T* y) {
  const T dy = (v - lens[3]) / lens[1];
  const T dx = (u - lens[2] - lens[4] * dy) / lens[0];
  double D[8];
  for (int i = 0; i < 8; ++i) D[i] = valueOf(lens[5 + i]);
  const Eigen::Vector2d at = undistorted(D, {valueOf(dx), valueOf(dy)}, model);
  using Slope = ceres::Jet<double, 2>;
  Slope ex, ey;
  T fx, fy;
  if (model == LensModel::Equidistant) {
    distortFisheyeT(D, Slope(at.x(), 0), Slope(at.y(), 1), &ex, &ey);
    distortFisheyeT(lens + 5, T(at.x()), T(at.y()), &fx, &fy);
  } else {
    distortT(D, Slope(at.x(), 0), Slope(at.y(), 1), &ex, &ey);
    distortT(lens + 5, T(at.x()), T(at.y()), &fx, &fy);
  }
  Eigen::Matrix2d J;
  J << ex.v.transpose(), ey.v.transpose();
  const Eigen::Matrix2d inverse = J.inverse();
  const T rx = fx - dx, ry = fy - dy;
  *x = at.x() - (inverse(0, 0) * rx + inverse(0, 1) * ry);
  *y = at.y() - (inverse(1, 0) * rx + inverse(1, 1) * ry);
}

/// Errors times the inverse root of their covariance.
template <typename T>
void whiten(const Matrix8& root, const T* error, T* residual) {
  for (int row = 0; row < 8; ++row) {
    residual[row] = T(0);
    for (int column = 0; column <= row; ++column)
      residual[row] += root(row, column) * error[column];
  }
}

/// Printed corners: seen minus predicted, in camera pixels.
struct PrintedCost {
  const Sighting* tag;
  Matrix8 root;
  LensModel camera_model;
  /// For a sheet stretched by 1 + stretch along its x axis.
  template <typename L, typename T>
  bool evaluate(const L* camera, const T* board, const T& stretch, T* residual) const {
    T error[8];
    for (std::size_t i = 0; i < 4; ++i) {
      const T p_board[3] = {tag->target[i].x() * (1.0 + stretch), T(tag->target[i].y()), T(0)};
      T p[3], u, v;
      ceres::AngleAxisRotatePoint(board, p_board, p);
      for (int k = 0; k < 3; ++k) p[k] += board[3 + k];
      projectT(camera, T(p[0] / p[2]), T(p[1] / p[2]), &u, &v, camera_model);
      error[2 * i] = tag->camera_px[i].x() - u;
      error[2 * i + 1] = tag->camera_px[i].y() - v;
    }
    whiten(root, error, residual);
    return true;
  }
  template <typename T>
  bool operator()(const T* camera, const T* board, T* residual) const {
    return evaluate(camera, board, T(0), residual);
  }
};

/// As PrintedCost, with a known camera: fewer derivatives, which take most of the solver's time.
struct PrintedKnownCameraCost {
  PrintedCost cost;
  LensBlock camera;
  template <typename T>
  bool operator()(const T* board, T* residual) const {
    return cost.evaluate(camera.data(), board, T(0), residual);
  }
};

struct StretchedCost {
  PrintedCost cost;
  template <typename T>
  bool operator()(const T* camera, const T* board, const T* stretch, T* residual) const {
    return cost.evaluate(camera, board, stretch[0], residual);
  }
};

/// Where the camera ray (x, y, 1) meets the board.
template <typename T>
void onBoardT(const T* board, const T& x, const T& y, T* p_camera) {
  const T z_axis[3] = {T(0), T(0), T(1)};
  T normal[3];
  ceres::AngleAxisRotatePoint(board, z_axis, normal);
  const T offset = normal[0] * board[3] + normal[1] * board[4] + normal[2] * board[5];
  p_camera[2] = offset / (normal[0] * x + normal[1] * y + normal[2]);
  p_camera[0] = x * p_camera[2];
  p_camera[1] = y * p_camera[2];
}

/// Projected corners: camera ray, board's plane, projector, against the pattern's pixels.
struct ProjectedCost {
  const Sighting* tag;
  Matrix8 root;        ///< of the errors in projector pixels
  Eigen::Matrix3d R0;  ///< T_camera_projector is R0 * exp(w), t
  LensModel camera_model;

  /// Of one corner at p_camera.
  template <typename P, typename T>
  void cornerError(std::size_t i, const P* p_camera, const T* lens, const T* pose, T* error) const {
    const T d[3] = {p_camera[0] - pose[3], p_camera[1] - pose[4], p_camera[2] - pose[5]};
    const T back[3] = {-pose[0], -pose[1], -pose[2]};
    T turned[3], p[3], u, v;
    for (int k = 0; k < 3; ++k) turned[k] = R0(0, k) * d[0] + R0(1, k) * d[1] + R0(2, k) * d[2];
    ceres::AngleAxisRotatePoint(back, turned, p);
    projectT(lens, T(p[0] / p[2]), T(p[1] / p[2]), &u, &v);
    error[0] = u - tag->target[i].x();
    error[1] = v - tag->target[i].y();
  }
  /// With the camera to be estimated too.
  template <typename T>
  bool operator()(const T* camera, const T* board, const T* lens, const T* pose,
                  T* residual) const {
    T error[8];
    for (std::size_t i = 0; i < 4; ++i) {
      T x, y, p_camera[3];
      unprojectT(camera, tag->camera_px[i].x(), tag->camera_px[i].y(), camera_model, &x, &y);
      onBoardT(board, x, y, p_camera);
      cornerError(i, p_camera, lens, pose, error + 2 * i);
    }
    whiten(root, error, residual);
    return true;
  }
};

/// As ProjectedCost, with a known camera.
struct ProjectedKnownCameraCost {
  ProjectedCost cost;
  template <typename T>
  bool operator()(const T* board, const T* lens, const T* pose, T* residual) const {
    T error[8];
    for (std::size_t i = 0; i < 4; ++i) {
      T p_camera[3];
      onBoardT(board, T(cost.tag->rays[i].x()), T(cost.tag->rays[i].y()), p_camera);
      cost.cornerError(i, p_camera, lens, pose, error + 2 * i);
    }
    whiten(cost.root, error, residual);
    return true;
  }
};

/// As ProjectedCost, with known camera and board.
struct ProjectedKnownBoardCost {
  ProjectedCost cost;
  std::array<Eigen::Vector3d, 4> p_camera;
  template <typename T>
  bool operator()(const T* lens, const T* pose, T* residual) const {
    T error[8];
    for (std::size_t i = 0; i < 4; ++i) {
      cost.cornerError(i, p_camera[i].data(), lens, pose, error + 2 * i);
    }
    whiten(cost.root, error, residual);
    return true;
  }
};

/// Prior knowledge of projectors, as standard deviations: without it high distortion terms explode
/// where no board was held.
struct LensPrior {
  double aspect;
  template <typename T>
  bool operator()(const T* lens, T* residual) const {
    constexpr double kDeviations[8] = {0.5, 0.3, 0.003, 0.003, 0.05, 0.3, 0.1, 0.03};
    residual[0] = (lens[0] / lens[1] - 1.0) / aspect;
    for (int i = 0; i < 8; ++i) residual[1 + i] = lens[5 + i] / kDeviations[i];
    return true;
  }
};

/// Prior knowledge of a camera: its camera_info, with the usual deviations. The aspect ratio is
/// known far better than the focal length, so the two are separate.
struct CameraPrior {
  LensBlock given;
  CameraDeviations deviations;
  template <typename T>
  bool operator()(const T* lens, T* residual) const {
    const T across = lens[0] / given[0], down = lens[1] / given[1];
    residual[0] = (0.5 * (across + down) - 1.0) / deviations.focal;
    residual[1] = (across - down) / deviations.aspect;
    residual[2] = (lens[2] - given[2]) / deviations.center_px;
    residual[3] = (lens[3] - given[3]) / deviations.center_px;
    for (std::size_t i = 0; i < 4; ++i) {
      residual[4 + i] = (lens[5 + i] - given[5 + i]) / deviations.D[i];
    }
    return true;
  }
};

}  // namespace afterglow::calib
