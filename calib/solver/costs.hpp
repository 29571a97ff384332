/// \file
/// The solver's cost functions, as Ceres differentiates them; only for the solver's own sources.
/// The costs keep references to their tags.
#pragma once

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cmath>

#include "calib/solver/board_shape.hpp"
#include "calib/solver/camera_change.hpp"
#include "calib/solver/evidence.hpp"

namespace afterglow::calib {

// Blocks of parameters as Ceres has them.
constexpr int kLensSize = 13;  // fx fy cx cy skew, then D
constexpr int kPoseSize = 6;   // rotation vector, translation
using LensBlock = std::array<double, kLensSize>;
using PoseBlock = std::array<double, kPoseSize>;
using ShapeBlock = std::array<double, kShapeSize>;

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

/// A point's pixel, with its derivatives by the point and by the lens.
struct PixelSlope {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, kLensSize> by_lens;
};

inline PixelSlope pixelSlope(const double* lens, const Eigen::Vector3d& p, LensModel model) {
  using Slope = ceres::Jet<double, 3 + kLensSize>;
  Slope point[3], block[kLensSize], u, v;
  for (int i = 0; i < 3; ++i) point[i] = Slope(p[i], i);
  for (int i = 0; i < kLensSize; ++i) block[i] = Slope(lens[i], 3 + i);
  projectT(block, Slope(point[0] / point[2]), Slope(point[1] / point[2]), &u, &v, model);
  PixelSlope slope;
  slope.pixel << u.a, v.a;
  slope.by_point << u.v.head<3>().transpose(), v.v.head<3>().transpose();
  slope.by_lens << u.v.tail<kLensSize>().transpose(), v.v.tail<kLensSize>().transpose();
  return slope;
}

inline Eigen::Matrix3d rotationOf(const double* turn) {
  Eigen::Matrix3d R;
  ceres::AngleAxisToRotationMatrix(turn, R.data());
  return R;
}

/// d (R p) / d rotation vector.
inline Eigen::Matrix3d turnedSlope(const double* turn, const Eigen::Vector3d& p) {
  using Slope = ceres::Jet<double, 3>;
  const Slope w[3] = {Slope(turn[0], 0), Slope(turn[1], 1), Slope(turn[2], 2)};
  const Slope from[3] = {Slope(p[0]), Slope(p[1]), Slope(p[2])};
  Slope to[3];
  ceres::AngleAxisRotatePoint(w, from, to);
  Eigen::Matrix3d slope;
  for (int i = 0; i < 3; ++i) slope.row(i) = to[i].v.transpose();
  return slope;
}

template <int kColumns>
using RowMajor8 = Eigen::Map<Eigen::Matrix<double, 8, kColumns, Eigen::RowMajor>>;

/// jacobians[block] += root * by, where the solver wants that block.
template <int kColumns>
void storeSlope(const Matrix8& root, const Eigen::Matrix<double, 8, kColumns>& by, double* to) {
  if (to) RowMajor8<kColumns>(to).noalias() = root.triangularView<Eigen::Lower>() * by;
}

/// Printed corners: seen minus predicted, in camera pixels, over camera, board and shape. The
/// derivatives are chained by hand: as automatic ones of all blocks they take five times as long.
class PrintedCost : public ceres::SizedCostFunction<8, kLensSize, kPoseSize, kShapeSize> {
 public:
  PrintedCost(const Sighting& tag, const Matrix8& root, LensModel model,
              const Eigen::Vector2d& half_m)
      : tag_(tag), root_(root), model_(model) {
    shape_.half_m = half_m;
  }

  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override {
    BoardShape shape = shape_;
    shape.parameters = Eigen::Map<const ShapeVector>(blocks[2]);
    const Eigen::Matrix3d R = rotationOf(blocks[1]);
    const Eigen::Map<const Eigen::Vector3d> t(blocks[1] + 3);
    Vector8 error;
    Eigen::Matrix<double, 8, kLensSize> by_camera;
    Eigen::Matrix<double, 8, kPoseSize> by_board;
    Eigen::Matrix<double, 8, kShapeSize> by_shape;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Index row = 2 * Eigen::Index(i);
      const Eigen::Vector3d p_board = shape.place(tag_.target[i]);
      const PixelSlope slope = pixelSlope(blocks[0], R * p_board + t, model_);
      error.segment<2>(row) = tag_.camera_px[i] - slope.pixel;
      if (!jacobians) continue;
      by_camera.middleRows<2>(row) = -slope.by_lens;
      by_board.block<2, 3>(row, 0) = -slope.by_point * turnedSlope(blocks[1], p_board);
      by_board.block<2, 3>(row, 3) = -slope.by_point;
      by_shape.middleRows<2>(row) =
          -(slope.by_point * R.col(2)) * shape.modesAt(tag_.target[i]).transpose();
      by_shape.block<2, 1>(row, 0) = -slope.by_point * R.col(0) * tag_.target[i].x();
    }
    Eigen::Map<Vector8>(residual).noalias() = root_.triangularView<Eigen::Lower>() * error;
    if (jacobians) {
      storeSlope(root_, by_camera, jacobians[0]);
      storeSlope(root_, by_board, jacobians[1]);
      storeSlope(root_, by_shape, jacobians[2]);
    }
    return error.allFinite();
  }

 private:
  const Sighting& tag_;
  Matrix8 root_;
  LensModel model_;
  BoardShape shape_;
};

/// The point where a camera ray meets the bent board, with its derivatives.
struct MeetingSlope {
  Eigen::Vector3d p_camera;
  Eigen::Matrix<double, 3, 2> by_ray;
  Eigen::Matrix<double, 3, kPoseSize> by_board;
  Eigen::Matrix<double, 3, kShapeSize> by_shape;
};

inline MeetingSlope meetingSlope(const Eigen::Vector2d& ray, const double* board,
                                 const BoardShape& shape) {
  Eigen::Isometry3d T_camera_board = Eigen::Isometry3d::Identity();
  T_camera_board.linear() = rotationOf(board);
  T_camera_board.translation() = Eigen::Map<const Eigen::Vector3d>(board + 3);
  const Eigen::Vector3d direction = ray.homogeneous();
  MeetingSlope slope;
  slope.p_camera = meetSheet(Eigen::Vector3d::Zero(), direction, T_camera_board, shape);
  const Eigen::Vector3d off = slope.p_camera - T_camera_board.translation();
  const Eigen::Vector3d p_board = T_camera_board.linear().transpose() * off;
  // The ray's way w solves F = z_board - height = 0; so d w = -d F / (d F / d w).
  const Eigen::Vector3d upright_board =
      (Eigen::Vector3d() << -shape.slope(p_board.head<2>()), 1).finished();
  const Eigen::Vector3d upright = T_camera_board.linear() * upright_board;
  const double way = slope.p_camera.z();
  const Eigen::Vector3d along = direction / upright.dot(direction);
  const double back[3] = {-board[0], -board[1], -board[2]};
  slope.by_ray = way * (Eigen::Matrix3d::Identity() - along * upright.transpose()).leftCols<2>();
  slope.by_board.leftCols<3>() =
      along * upright_board.transpose() * turnedSlope(back, off);  // d back / d board = -1
  slope.by_board.rightCols<3>() = along * upright.transpose();
  slope.by_shape = along * shape.modesAt(p_board.head<2>()).transpose();
  return slope;
}

/// Projected corners: camera ray, board, projector, against the pattern's pixels; over camera,
/// board, shape, lens and pose.
class ProjectedCost
    : public ceres::SizedCostFunction<8, kLensSize, kPoseSize, kShapeSize, kLensSize, kPoseSize> {
 public:
  /// `root`: of the errors in projector pixels. T_camera_projector is R0 * exp(w), t.
  ProjectedCost(const Sighting& tag, const Matrix8& root, const Eigen::Matrix3d& R0,
                LensModel camera_model, const Eigen::Vector2d& half_m)
      : tag_(tag), root_(root), R0_(R0), camera_model_(camera_model) {
    shape_.half_m = half_m;
  }

  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override {
    BoardShape shape = shape_;
    shape.parameters = Eigen::Map<const ShapeVector>(blocks[2]);
    const double* pose = blocks[4];
    const double back[3] = {-pose[0], -pose[1], -pose[2]};
    const Eigen::Matrix3d R = rotationOf(back) * R0_.transpose();
    Vector8 error;
    Slopes slopes;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Index row = 2 * Eigen::Index(i);
      Eigen::Matrix<double, 2, kLensSize> ray_by_camera;
      const bool wants_camera = jacobians && jacobians[0];
      const Eigen::Vector2d ray = rayOf(blocks[0], i, wants_camera ? &ray_by_camera : nullptr);
      const MeetingSlope meeting = meetingSlope(ray, blocks[1], shape);
      const Eigen::Vector3d off =
          meeting.p_camera - Eigen::Map<const Eigen::Vector3d>(pose + 3);
      const PixelSlope slope = pixelSlope(blocks[3], R * off, LensModel::BrownConrady);
      error.segment<2>(row) = slope.pixel - tag_.target[i];
      if (!jacobians) continue;
      const Eigen::Matrix<double, 2, 3> by_camera_point = slope.by_point * R;
      if (wants_camera) {
        slopes.camera.middleRows<2>(row) = by_camera_point * meeting.by_ray * ray_by_camera;
      }
      slopes.board.middleRows<2>(row) = by_camera_point * meeting.by_board;
      slopes.shape.middleRows<2>(row) = by_camera_point * meeting.by_shape;
      slopes.lens.middleRows<2>(row) = slope.by_lens;
      slopes.pose.block<2, 3>(row, 0) =
          -slope.by_point * turnedSlope(back, R0_.transpose() * off);
      slopes.pose.block<2, 3>(row, 3) = -by_camera_point;
    }
    Eigen::Map<Vector8>(residual).noalias() = root_.triangularView<Eigen::Lower>() * error;
    if (jacobians) store(slopes, jacobians);
    return error.allFinite();
  }

 private:
  struct Slopes {
    Eigen::Matrix<double, 8, kLensSize> camera, lens;
    Eigen::Matrix<double, 8, kPoseSize> board, pose;
    Eigen::Matrix<double, 8, kShapeSize> shape;
  };

  Eigen::Vector2d rayOf(const double* camera, std::size_t i,
                        Eigen::Matrix<double, 2, kLensSize>* by_camera) const {
    const Eigen::Vector2d& pixel = tag_.camera_px[i];
    Eigen::Vector2d ray;
    if (!by_camera) {
      unprojectT(camera, pixel.x(), pixel.y(), camera_model_, &ray.x(), &ray.y());
      return ray;
    }
    using Slope = ceres::Jet<double, kLensSize>;
    Slope block[kLensSize], x, y;
    for (int k = 0; k < kLensSize; ++k) block[k] = Slope(camera[k], k);
    unprojectT(block, pixel.x(), pixel.y(), camera_model_, &x, &y);
    *by_camera << x.v.transpose(), y.v.transpose();
    return {x.a, y.a};
  }

  void store(const Slopes& slopes, double** jacobians) const {
    storeSlope(root_, slopes.camera, jacobians[0]);
    storeSlope(root_, slopes.board, jacobians[1]);
    storeSlope(root_, slopes.shape, jacobians[2]);
    storeSlope(root_, slopes.lens, jacobians[3]);
    storeSlope(root_, slopes.pose, jacobians[4]);
  }

  const Sighting& tag_;
  Matrix8 root_;
  Eigen::Matrix3d R0_;
  LensModel camera_model_;
  BoardShape shape_;
};

/// Prior knowledge of boards; the stretch may be left to the views.
struct ShapePrior {
  ShapeVector deviations;
  template <typename T>
  bool operator()(const T* shape, T* residual) const {
    for (int i = 0; i < kShapeSize; ++i) residual[i] = shape[i] / deviations[i];
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

/// Prior knowledge of a projector that was calibrated before.
struct LensDriftPrior {
  using Vector = Eigen::Matrix<double, kLensSize, 1>;
  using Matrix = Eigen::Matrix<double, kLensSize, kLensSize>;
  LensBlock before;
  Matrix root;  ///< root^T root: information
  template <typename T>
  bool operator()(const T* lens, T* residual) const {
    for (int i = 0; i < kLensSize; ++i) {
      residual[i] = T(0);
      for (int k = 0; k <= i; ++k) residual[i] += root(i, k) * (lens[k] - before[std::size_t(k)]);
    }
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
