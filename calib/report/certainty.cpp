#include "calib/report/certainty.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace afterglow::calib {
namespace {

/// 95 % of a two-dimensional normal distribution lies within chi^2 = -2 ln 0.05.
const double kChi95 = std::sqrt(-2 * std::log(0.05));

double longestHalfAxis(const Eigen::Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance, Eigen::EigenvaluesOnly);
  return kChi95 * std::sqrt(std::max(0.0, eigen.eigenvalues().maxCoeff()));
}

/// Meters on the plane z = distance for a pixel's step, by central differences over one pixel.
std::optional<Eigen::Matrix2d> metersPerPixel(const Lens& lens, const Eigen::Vector2d& pixel,
                                              double distance_m) {
  Eigen::Matrix2d J;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d half = 0.5 * Eigen::Vector2d::Unit(axis);
    const auto ahead = unproject(lens, pixel + half), behind = unproject(lens, pixel - half);
    if (!ahead || !behind) return std::nullopt;
    J.col(axis) = (*ahead - *behind).head<2>() * distance_m;
  }
  return J;
}

}  // namespace

std::optional<Uncertainty> uncertaintyAt(const ProjectorEstimate& estimate,
                                         const Eigen::Vector2d& pixel, double distance_m) {
  const auto ray = unproject(estimate.projector, pixel);
  const auto J = metersPerPixel(estimate.projector, pixel, distance_m);
  if (!ray || !J) return std::nullopt;
  const auto predicted = predictPixel(estimate, estimate.T_camera_projector * (*ray * distance_m));
  if (!predicted || !predicted->covariance.allFinite()) return std::nullopt;
  return Uncertainty{longestHalfAxis(predicted->covariance),
                     1000 * longestHalfAxis(*J * predicted->covariance * J->transpose())};
}

UncertaintyGrid uncertaintyGrid(const ProjectorEstimate& estimate, double distance_m) {
  UncertaintyGrid grid;
  grid.columns = 4 * Coverage::kColumns;
  grid.rows = 4 * Coverage::kRows;
  grid.distance_m = distance_m;
  grid.cell_px = Eigen::Vector2d(double(estimate.projector.width) / grid.columns,
                                 double(estimate.projector.height) / grid.rows);
  for (int i = 0; i < grid.columns * grid.rows; ++i) {
    const Eigen::Vector2d center(i % grid.columns + 0.5, i / grid.columns + 0.5);
    grid.cells.push_back(uncertaintyAt(
        estimate, grid.cell_px.cwiseProduct(center) - Eigen::Vector2d(0.5, 0.5), distance_m));
  }
  return grid;
}

std::optional<LightShift> shiftBetween(const ProjectorEstimate& before,
                                       const ProjectorEstimate& after, double distance_m) {
  constexpr int kSteps = 8;
  const Lens& lens = before.projector;
  if (lens.width != after.projector.width || lens.height != after.projector.height) return {};
  const Rigid<Projector, Camera> T_after_camera = after.T_camera_projector.inverse();
  LightShift shift;
  int count = 0;
  for (int i = 0; i <= kSteps * kSteps + 2 * kSteps; ++i) {
    const Eigen::Vector2d share(i % (kSteps + 1), i / (kSteps + 1));
    const Eigen::Vector2d pixel =
        share.cwiseProduct(Eigen::Vector2d(lens.width - 1, lens.height - 1)) / kSteps;
    const auto ray = unproject(lens, pixel);
    const auto J = metersPerPixel(lens, pixel, distance_m);
    if (!ray || !J) continue;
    const auto now = project(after.projector,
                             T_after_camera * (before.T_camera_projector * (*ray * distance_m)));
    if (!now) continue;
    const double mm = 1000 * (*J * (*now - pixel)).norm();
    shift.rms_px += (*now - pixel).squaredNorm();
    shift.rms_mm += mm * mm;
    shift.largest_mm = std::max(shift.largest_mm, mm);
    ++count;
  }
  if (count == 0) return std::nullopt;
  shift.rms_px = std::sqrt(shift.rms_px / count);
  shift.rms_mm = std::sqrt(shift.rms_mm / count);
  return shift;
}

}  // namespace afterglow::calib
