/// \file
/// The solver's cost functions, as Ceres differentiates them; only for the solver's own sources.
/// The costs keep references to their tags.
#pragma once

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <optional>

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

/// A lens without its size and its fold.
inline Lens lensOf(const double* block, LensModel model) {
  Lens lens;
  lens.model = model;
  lens.K << block[0], block[4], block[2], 0, block[1], block[3], 0, 0, 1;
  std::copy_n(block + 5, lens.D.size(), lens.D.begin());
  return lens;
}

/// d ray / d point
inline Eigen::Matrix<double, 2, 3> raySlope(const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 2, 3> slope;
  slope << Eigen::Matrix2d::Identity(), -p.hnormalized();
  return slope / p.z();
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
    const Lens camera = lensOf(blocks[0], model_);
    Vector8 error;
    Eigen::Matrix<double, 8, kLensSize> by_camera;
    Eigen::Matrix<double, 8, kPoseSize> by_board;
    Eigen::Matrix<double, 8, kShapeSize> by_shape;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Index row = 2 * Eigen::Index(i);
      const Eigen::Vector3d p_board = shape.place(tag_.target[i]);
      const Eigen::Vector3d p = R * p_board + t;
      const PixelSlope slope = pixelSlope(camera, p.hnormalized());
      error.segment<2>(row) = tag_.camera_px[i] - slope.pixel;
      if (!jacobians) continue;
      const Eigen::Matrix<double, 2, 3> by_point = -slope.by_ray * raySlope(p);
      by_camera.middleRows<2>(row) = -slope.by_lens;
      by_board.block<2, 3>(row, 0) = by_point * turnedSlope(blocks[1], p_board);
      by_board.block<2, 3>(row, 3) = by_point;
      by_shape.middleRows<2>(row) =
          (by_point * R.col(2)) * shape.modesAt(tag_.target[i]).transpose();
      by_shape.block<2, 1>(row, 0) = by_point * R.col(0) * tag_.target[i].x();
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
  /// `root`: of the errors in projector pixels. T_camera_projector is R0 * exp(w), t. A camera that
  /// is not free has the tag's rays.
  ProjectedCost(const Sighting& tag, const Matrix8& root, const Eigen::Matrix3d& R0,
                LensModel camera_model, bool is_camera_free, const Eigen::Vector2d& half_m)
      : tag_(tag),
        root_(root),
        R0_(R0),
        camera_model_(camera_model),
        is_camera_free_(is_camera_free) {
    shape_.half_m = half_m;
  }

  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override {
    BoardShape shape = shape_;
    shape.parameters = Eigen::Map<const ShapeVector>(blocks[2]);
    const double* pose = blocks[4];
    const double back[3] = {-pose[0], -pose[1], -pose[2]};
    const Eigen::Matrix3d R = rotationOf(back) * R0_.transpose();
    const Lens camera = lensOf(blocks[0], camera_model_);
    const Lens projector = lensOf(blocks[3], LensModel::BrownConrady);
    Vector8 error;
    Slopes slopes;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Index row = 2 * Eigen::Index(i);
      const auto ray = is_camera_free_ ? unproject(camera, tag_.camera_px[i])
                                       : std::optional(tag_.rays[i].homogeneous().eval());
      if (!ray) return false;
      const MeetingSlope meeting = meetingSlope(ray->head<2>(), blocks[1], shape);
      const Eigen::Vector3d off =
          meeting.p_camera - Eigen::Map<const Eigen::Vector3d>(pose + 3);
      const Eigen::Vector3d p = R * off;
      const PixelSlope slope = pixelSlope(projector, p.hnormalized());
      error.segment<2>(row) = slope.pixel - tag_.target[i];
      if (!jacobians) continue;
      const Eigen::Matrix<double, 2, 3> by_point = slope.by_ray * raySlope(p);
      const Eigen::Matrix<double, 2, 3> by_camera_point = by_point * R;
      if (jacobians[0]) {
        const PixelSlope seen = pixelSlope(camera, ray->head<2>());
        slopes.camera.middleRows<2>(row) =
            -by_camera_point * meeting.by_ray * seen.by_ray.inverse() * seen.by_lens;
      }
      slopes.board.middleRows<2>(row) = by_camera_point * meeting.by_board;
      slopes.shape.middleRows<2>(row) = by_camera_point * meeting.by_shape;
      slopes.lens.middleRows<2>(row) = slope.by_lens;
      slopes.pose.block<2, 3>(row, 0) = -by_point * turnedSlope(back, R0_.transpose() * off);
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
  bool is_camera_free_;
  BoardShape shape_;
};

}  // namespace afterglow::calib
