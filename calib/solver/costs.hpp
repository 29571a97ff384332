/// \file
/// What the solver minimizes, as Ceres differentiates it: only for the solver's own sources. The
/// costs keep pointers to their tags.
#pragma once

#include <ceres/rotation.h>

#include <Eigen/Core>
#include <array>

#include "calib/solver/evidence.hpp"

namespace afterglow::calib {

// Blocks of parameters as Ceres has them.
constexpr int kLensSize = 13;  // fx fy cx cy skew, then D
constexpr int kPoseSize = 6;   // rotation vector, translation
using LensBlock = std::array<double, kLensSize>;
using PoseBlock = std::array<double, kPoseSize>;

/// OpenCV's camera model on z = 1 coordinates.
template <typename T>
void distortT(const T* D, const T& x, const T& y, T* dx, T* dy) {
  const T s = x * x + y * y;
  const T radial =
      (1.0 + s * (D[0] + s * (D[1] + s * D[4]))) / (1.0 + s * (D[5] + s * (D[6] + s * D[7])));
  *dx = x * radial + 2.0 * D[2] * x * y + D[3] * (s + 2.0 * x * x);
  *dy = y * radial + D[2] * (s + 2.0 * y * y) + 2.0 * D[3] * x * y;
}

template <typename T>
void projectT(const T* lens, const T& x, const T& y, T* u, T* v) {
  T dx, dy;
  distortT(lens + 5, x, y, &dx, &dy);
  *u = lens[0] * dx + lens[4] * dy + lens[2];
  *v = lens[1] * dy + lens[3];
}

/// Inverse of projectT by fixed-point iteration; converges for every lens whose image does not
/// fold.
template <typename T>
void unprojectT(const T* lens, double u, double v, T* x, T* y) {
  const T dy = (v - lens[3]) / lens[1];
  const T dx = (u - lens[2] - lens[4] * dy) / lens[0];
  *x = dx;
  *y = dy;
  for (int i = 0; i < 25; ++i) {
    T ex, ey;
    distortT(lens + 5, *x, *y, &ex, &ey);
    *x -= ex - dx;
    *y -= ey - dy;
  }
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

/// Printed corners: camera pixels against where pose and camera put them.
struct PrintedCost {
  const Sighting* tag;
  Matrix8 root;
  template <typename T>
  bool operator()(const T* camera, const T* board, T* residual) const {
    T error[8];
    for (std::size_t i = 0; i < 4; ++i) {
      const T p_board[3] = {T(tag->target[i].x()), T(tag->target[i].y()), T(0)};
      cornerError(i, camera, board, p_board, error + 2 * i);
    }
    whiten(root, error, residual);
    return true;
  }
  template <typename T>
  void cornerError(std::size_t i, const T* camera, const T* board, const T* p_board,
                   T* error) const {
    T p[3], u, v;
    ceres::AngleAxisRotatePoint(board, p_board, p);
    for (int k = 0; k < 3; ++k) p[k] += board[3 + k];
    projectT(camera, T(p[0] / p[2]), T(p[1] / p[2]), &u, &v);
    error[0] = tag->camera_px[i].x() - u;
    error[1] = tag->camera_px[i].y() - v;
  }
};

/// The same on a sheet stretched by 1 + stretch along its x axis.
struct StretchedCost {
  PrintedCost cost;
  template <typename T>
  bool operator()(const T* camera, const T* board, const T* stretch, T* residual) const {
    T error[8];
    for (std::size_t i = 0; i < 4; ++i) {
      const T p_board[3] = {cost.tag->target[i].x() * (1.0 + stretch[0]),
                            T(cost.tag->target[i].y()), T(0)};
      cost.cornerError(i, camera, board, p_board, error + 2 * i);
    }
    whiten(cost.root, error, residual);
    return true;
  }
};

/// Projected corners: camera ray, board's plane, projector, against the pattern's pixels.
struct ProjectedCost {
  const Sighting* tag;
  Matrix8 root;  ///< of the errors in projector pixels
  bool free_camera;
  Eigen::Matrix3d R0;  ///< T_camera_projector is R0 * exp(w), t
  template <typename T>
  bool operator()(const T* camera, const T* board, const T* lens, const T* pose,
                  T* residual) const {
    T normal[3];
    const T z_axis[3] = {T(0), T(0), T(1)};
    ceres::AngleAxisRotatePoint(board, z_axis, normal);
    const T offset = normal[0] * board[3] + normal[1] * board[4] + normal[2] * board[5];
    const T back[3] = {-pose[0], -pose[1], -pose[2]};
    T error[8];
    for (std::size_t i = 0; i < 4; ++i) {
      T x = T(tag->rays[i].x()), y = T(tag->rays[i].y());
      if (free_camera) unprojectT(camera, tag->camera_px[i].x(), tag->camera_px[i].y(), &x, &y);
      const T depth = offset / (normal[0] * x + normal[1] * y + normal[2]);
      const T d[3] = {x * depth - pose[3], y * depth - pose[4], depth - pose[5]};
      T turned[3], p[3];
      for (int k = 0; k < 3; ++k) turned[k] = R0(0, k) * d[0] + R0(1, k) * d[1] + R0(2, k) * d[2];
      ceres::AngleAxisRotatePoint(back, turned, p);
      T u, v;
      projectT(lens, T(p[0] / p[2]), T(p[1] / p[2]), &u, &v);
      error[2 * i] = u - tag->target[i].x();
      error[2 * i + 1] = v - tag->target[i].y();
    }
    whiten(root, error, residual);
    return true;
  }
};

/// What is known of projectors before any is measured, as standard deviations: without it high
/// distortion terms explode where no board was held.
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

}  // namespace afterglow::calib
