#include "calib/solver/calibration.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace afterglow::calib {
namespace {

using Perturbation = Eigen::Matrix<double, kCalibrationParameters, 1>;

Eigen::Matrix3d exponential(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

/// The estimate with its parameters, in the covariance's order, moved by so much.
std::optional<Eigen::Vector2d> projectPerturbed(const ProjectorEstimate& estimate,
                                                const Eigen::Vector3d& p_camera,
                                                const Perturbation& by) {
  Lens lens = estimate.projector;
  lens.K(0, 0) += by[0];
  lens.K(1, 1) += by[1];
  lens.K(0, 2) += by[2];
  lens.K(1, 2) += by[3];
  for (std::size_t i = 0; i < lens.D.size(); ++i) lens.D[i] += by[4 + Eigen::Index(i)];
  Eigen::Isometry3d T = estimate.T_camera_projector.matrix();
  T.linear() = T.linear() * exponential(by.segment<3>(12));
  T.translation() += by.segment<3>(15);
  return project(lens, T.inverse() * p_camera);
}

}  // namespace

std::optional<Eigen::Matrix<double, 2, kCalibrationParameters>> pixelSlopes(
    const ProjectorEstimate& estimate, const Eigen::Vector3d& p_camera) {
  Eigen::Matrix<double, 2, kCalibrationParameters> J;
  for (int i = 0; i < kCalibrationParameters; ++i) {
    // A thousandth of a deviation: linear, and far above rounding.
    const double step = 1e-3 * std::sqrt(std::max(0.0, estimate.covariance(i, i)));
    J.col(i).setZero();
    if (step == 0) continue;
    const Perturbation by = step * Perturbation::Unit(i);
    const auto above = projectPerturbed(estimate, p_camera, by);
    const auto below = projectPerturbed(estimate, p_camera, -by);
    if (!above || !below) return std::nullopt;
    J.col(i) = (*above - *below) / (2 * step);
  }
  return J;
}

std::optional<PredictedPixel> predictPixel(const ProjectorEstimate& estimate,
                                           const Eigen::Vector3d& p_camera) {
  const auto pixel = projectPerturbed(estimate, p_camera, Perturbation::Zero());
  const auto J = pixel ? pixelSlopes(estimate, p_camera) : std::nullopt;
  if (!J) return std::nullopt;
  return PredictedPixel{*pixel, *J * estimate.covariance * J->transpose()};
}

double Coverage::share() const {
  const auto filled = std::count_if(corners.begin(), corners.end(), [](int n) { return n > 0; });
  return double(filled) / std::max(possible, 1);
}

Coverage coverageOf(const std::vector<Eigen::Vector2d>& corners_px, const Pattern& pattern) {
  const auto cellOf = [&](const Eigen::Vector2d& corner) {
    const int column = static_cast<int>((corner.x() + 0.5) * Coverage::kColumns / pattern.width);
    const int row = static_cast<int>((corner.y() + 0.5) * Coverage::kRows / pattern.height);
    return static_cast<std::size_t>(std::clamp(row, 0, Coverage::kRows - 1) * Coverage::kColumns +
                                    std::clamp(column, 0, Coverage::kColumns - 1));
  };
  Coverage coverage;
  std::set<std::size_t> possible;
  for (const Tag& tag : pattern.tags) {
    for (const Eigen::Vector2d& corner : tag.corners) possible.insert(cellOf(corner));
  }
  coverage.possible = static_cast<int>(possible.size());
  for (const Eigen::Vector2d& corner : corners_px) ++coverage.corners[cellOf(corner)];
  return coverage;
}

Coverage coverageOf(const std::vector<View>& views, const Pattern& pattern) {
  std::map<int, const Tag*> by_id;
  for (const Tag& tag : pattern.tags) by_id[tag.id] = &tag;
  std::vector<Eigen::Vector2d> corners;
  for (const View& view : views) {
    if (!view.faults.empty()) continue;
    for (const SeenTag& seen : view.projected) {
      const auto found = by_id.find(seen.id);
      if (found == by_id.end()) continue;
      corners.insert(corners.end(), found->second->corners.begin(), found->second->corners.end());
    }
  }
  return coverageOf(corners, pattern);
}

std::string lightText(const Calibration& calibration) {
  if (calibration.light.empty()) return "";
  std::vector<std::string> parts;
  for (const LightError& error : calibration.light) {
    parts.push_back(fmt::format("{:.2f} mm at {:.0f} m", error.mm, error.distance_m));
  }
  return fmt::format(
      "Light is off by at most {} (95 %), and by {:.2f} mm for each 0.1 % that the print's size is "
      "off",
      fmt::join(parts, ", "), calibration.print_mm_per_permille);
}

CalibrationRefused::CalibrationRefused(const std::vector<std::string>& reasons)
    : std::runtime_error(fmt::format("{}", fmt::join(reasons, "; "))), reasons_(reasons) {}

CalibrationRefused::CalibrationRefused(const std::vector<std::string>& reasons,
                                       std::vector<ViewResult> views)
    : std::runtime_error(fmt::format("{}", fmt::join(reasons, "; "))),
      reasons_(reasons),
      views_(std::move(views)) {}

}  // namespace afterglow::calib
