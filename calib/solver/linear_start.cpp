#include "calib/median.hpp"
#include "calib/solver/linear_start.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <random>

namespace afterglow::calib {
namespace {

struct Point {
  Eigen::Vector3d p_camera;
  Eigen::Vector2d pixel;
};
using Projection = Eigen::Matrix<double, 3, 4>;

std::vector<Point> pointsOf(const ViewEvidence& view) {
  std::vector<Point> points;
  for (const Sighting& tag : view.projected) {
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector3d p = onBoard(tag.rays[i], view.T_camera_board);
      if (p.allFinite()) points.push_back({p, tag.target[i]});
    }
  }
  return points;
}

std::optional<Projection> directLinearTransform(const std::vector<Point>& points, double width) {
  if (points.size() < 12) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Point& point : points) middle += point.p_camera / double(points.size());
  // Normalized, so that all equations have about the same weight.
  Eigen::Matrix<double, 12, 12> normal = Eigen::Matrix<double, 12, 12>::Zero();
  for (const Point& point : points) {
    const Eigen::Vector4d X = (point.p_camera - middle).homogeneous();
    const Eigen::Vector2d x = 2 * point.pixel / width;
    Eigen::Matrix<double, 2, 12> rows = Eigen::Matrix<double, 2, 12>::Zero();
    rows.block<1, 4>(0, 0) = X;
    rows.block<1, 4>(0, 8) = -x.x() * X;
    rows.block<1, 4>(1, 4) = X;
    rows.block<1, 4>(1, 8) = -x.y() * X;
    normal += rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(normal);
  const Eigen::Matrix<double, 12, 1> p = eigen.eigenvectors().col(0);
  Projection P;
  P << p.segment<4>(0).transpose(), p.segment<4>(4).transpose(), p.segment<4>(8).transpose();
  Eigen::Matrix4d moved = Eigen::Matrix4d::Identity();
  moved.topRightCorner<3, 1>() = -middle;
  P = Eigen::Vector3d(width / 2, width / 2, 1).asDiagonal() * P * moved;
  return P.allFinite() ? std::optional<Projection>(P) : std::nullopt;
}

/// P = s K [R | t], with R a rotation and the points in front.
std::optional<LinearStart> decompose(const Projection& P, const std::vector<Point>& points) {
  Eigen::Matrix3d M = P.leftCols<3>();
  const double sign = M.determinant() < 0 ? -1 : 1;
  M *= sign;
  // RQ decomposition: Gram and Schmidt's from the last row up. With two positive numbers on the
  // diagonal and two positive determinants the third is positive, too.
  Eigen::Matrix3d R;
  R.row(2) = M.row(2).normalized();
  R.row(1) = (M.row(1) - M.row(1).dot(R.row(2)) * R.row(2)).normalized();
  R.row(0) = R.row(1).cross(R.row(2));
  const Eigen::Matrix3d upper = (M * R.transpose()).triangularView<Eigen::Upper>();
  if (!upper.allFinite() || !(upper.diagonal().minCoeff() > 0)) return std::nullopt;
  const Eigen::Vector3d t = upper.inverse() * (sign * P.col(3));
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();  // T_projector_camera
  T.linear() = R;
  T.translation() = t;
  const auto in_front = std::count_if(points.begin(), points.end(), [&](const Point& point) {
    return (T * point.p_camera).z() > 0;
  });
  if (2 * std::size_t(in_front) < points.size()) return std::nullopt;
  return LinearStart{upper / upper(2, 2), Rigid<Projector, Camera>(T).inverse()};
}

/// Median over the views of each view's median error, px; robust to less than half of them.
double disagreement(const Projection& P, const std::vector<std::vector<Point>>& views) {
  std::vector<double> medians, errors;
  for (const std::vector<Point>& points : views) {
    errors.clear();
    for (const Point& point : points) {
      errors.push_back(((P * point.p_camera.homogeneous()).hnormalized() - point.pixel).norm());
    }
    if (!errors.empty()) medians.push_back(median(errors, 0));
  }
  return median(medians, 0);
}

}  // namespace

std::optional<LinearStart> linearStart(const std::vector<ViewEvidence>& views,
                                       const Pattern& pattern) {
  std::vector<std::vector<Point>> by_view;
  for (const ViewEvidence& view : views) {
    if (view.is_used) by_view.push_back(pointsOf(view));
  }
  if (by_view.size() < 3) return std::nullopt;
  // With a seed, so that the same pictures give the same calibration.
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> pick(0, by_view.size() - 1);
  double best = std::numeric_limits<double>::infinity();
  std::optional<LinearStart> start;
  constexpr int kTrials = 120;
  const std::size_t sample = std::min<std::size_t>(by_view.size() < 6 ? 3 : 5, by_view.size());
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<std::size_t> chosen;
    while (chosen.size() < sample) {
      const std::size_t candidate = pick(random);
      if (std::find(chosen.begin(), chosen.end(), candidate) == chosen.end()) {
        chosen.push_back(candidate);
      }
    }
    std::vector<Point> points;
    for (std::size_t i : chosen) points.insert(points.end(), by_view[i].begin(), by_view[i].end());
    const auto P = directLinearTransform(points, pattern.width);
    if (!P) continue;
    const double error = disagreement(*P, by_view);
    if (!(error < best)) continue;
    const auto candidate = decompose(*P, points);
    if (!candidate) continue;
    best = error;
    start = candidate;
  }
  return start;
}

}  // namespace afterglow::calib
