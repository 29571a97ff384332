#include "calib/median.hpp"
#include "calib/solver/tag_errors.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace afterglow::calib {
namespace {

/// d projector pixel / d camera pixel at a corner, through the board's plane.
Eigen::Matrix2d pixelTransfer(const ProjectorModel& model, const ViewEvidence& view,
                              const Eigen::Vector2d& ray) {
  const Rigid<Projector, Camera> T_projector_camera = model.T_camera_projector.inverse();
  const auto pixel = [&](const Eigen::Vector2d& at) -> Eigen::Vector2d {
    const Eigen::Vector3d p = T_projector_camera * onBoard(at, view.T_camera_board, model.shape);
    return (model.projector.K * distort(model.projector, p.hnormalized()).homogeneous()).head<2>();
  };
  // A tenth of a camera pixel. The camera's own distortion changes its scale by a few percent
  // only.
  const double step = 0.1 / model.camera.K(0, 0);
  Eigen::Matrix2d J;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d by = step * Eigen::Vector2d::Unit(k);
    J.col(k) = (pixel(ray + by) - pixel(ray - by)) / (2 * 0.1);
  }
  return J;
}

double deviationsOf(const Vector8& error, const Matrix8& covariance, double scale) {
  return (whitening(covariance) * error).norm() / (std::sqrt(8.0) * scale);
}

constexpr double kOutlierDeviations = 6;

struct Deviations {
  std::vector<double> printed, projected;
};

Deviations deviationsOf(const ProjectorModel& model, const std::vector<ViewEvidence>& views) {
  Deviations all;
  for (const ViewEvidence& view : views) {
    if (!view.is_used) continue;
    for (const Sighting& tag : view.printed) {
      all.printed.push_back(printedError(model, view, tag).deviations);
    }
    for (const Sighting& tag : view.projected) {
      all.projected.push_back(projectedError(model, view, tag).deviations);
    }
  }
  return all;
}

double rootMeanSquare(const std::vector<double>& deviations) {
  double sum = 0;
  int count = 0;
  for (double one : deviations) {
    if (!(one < kOutlierDeviations)) continue;
    sum += one * one;
    ++count;
  }
  return count > 0 ? std::max(1.0, std::sqrt(sum / count)) : 1;
}

}  // namespace

Matrix8 whitening(const Matrix8& covariance) {
  const Matrix8 L = covariance.llt().matrixL();
  return L.triangularView<Eigen::Lower>().solve(Matrix8::Identity());
}

Matrix8 projectorCovariance(const ProjectorModel& model, const ViewEvidence& view,
                            const Sighting& tag) {
  Matrix8 J = Matrix8::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Index k = 2 * Eigen::Index(i);
    J.block<2, 2>(k, k) = pixelTransfer(model, view, tag.rays[i]);
  }
  return J * tag.covariance * J.transpose();
}

bool isOutlier(const TagError& error) { return !(error.deviations < kOutlierDeviations); }

TagError printedError(const ProjectorModel& model, const ViewEvidence& view, const Sighting& tag) {
  TagError result;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto pixel =
        project(model.camera, view.T_camera_board * model.shape.place(tag.target[i]));
    result.error.segment<2>(2 * Eigen::Index(i)) =
        pixel ? Eigen::Vector2d(tag.camera_px[i] - *pixel)
              : Eigen::Vector2d(Eigen::Vector2d::Constant(std::nan("")));
  }
  result.deviations = deviationsOf(result.error, tag.covariance, model.printed_scale);
  return result;
}

TagError projectedError(const ProjectorModel& model, const ViewEvidence& view,
                        const Sighting& tag) {
  TagError result;
  const Rigid<Projector, Camera> T_projector_camera = model.T_camera_projector.inverse();
  for (std::size_t i = 0; i < 4; ++i) {
    const auto pixel =
        project(model.projector,
                T_projector_camera * onBoard(tag.rays[i], view.T_camera_board, model.shape));
    result.error.segment<2>(2 * Eigen::Index(i)) =
        pixel ? Eigen::Vector2d(*pixel - tag.target[i])
              : Eigen::Vector2d(Eigen::Vector2d::Constant(std::nan("")));
  }
  result.deviations =
      deviationsOf(result.error, projectorCovariance(model, view, tag), model.projected_scale);
  return result;
}

void measureScales(ProjectorModel& model, const std::vector<ViewEvidence>& views) {
  model.printed_scale = model.projected_scale = 1;
  Deviations all = deviationsOf(model, views);
  // The middle of a chi with eight degrees of freedom, per degree, is 0.958.
  constexpr double kMiddle = 0.958;
  constexpr double kLeast = 1e-3;
  if (!all.printed.empty()) {
    model.printed_scale = std::max(median(all.printed, 0) / kMiddle, kLeast);
  }
  if (!all.projected.empty()) {
    model.projected_scale = std::max(median(all.projected, 0) / kMiddle, kLeast);
  }
}

void widenScales(ProjectorModel& model, const std::vector<ViewEvidence>& views) {
  const Deviations all = deviationsOf(model, views);
  model.printed_scale *= rootMeanSquare(all.printed);
  model.projected_scale *= rootMeanSquare(all.projected);
}

}  // namespace afterglow::calib
