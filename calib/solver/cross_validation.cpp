#include "calib/solver/cross_validation.hpp"

#include <algorithm>
#include <cmath>

#include "calib/landing.hpp"
#include "calib/parallel.hpp"

namespace afterglow::calib {
namespace {

HeldOut measure(const ProjectorModel& model, const ViewEvidence& view) {
  HeldOut result;
  const Rigid<Projector, Surface> T_projector_board =
      model.T_camera_projector.inverse() * view.T_camera_board;
  double px = 0, mm = 0;
  for (const Sighting& tag : view.projected) {
    const TagError error = projectedError(model, view, tag);
    if (!error.error.allFinite()) continue;
    px += error.error.squaredNorm();
    for (std::size_t i = 0; i < 4; ++i) {
      const auto wanted = landing(model.projector, tag.target[i], T_projector_board);
      const Eigen::Vector3d seen =
          view.T_camera_board.inverse() * onBoard(tag.rays[i], view.T_camera_board);
      if (wanted) mm += 1e6 * (seen.head<2>() - *wanted).squaredNorm();
    }
    result.corners += 4;
  }
  if (result.corners > 0) {
    result.rms_px = std::sqrt(px / result.corners);
    result.rms_mm = std::sqrt(mm / result.corners);
  }
  return result;
}

/// Sum over replicates of squared distances to their mean, times (n - 1) / n.
double jackknifeVariance(const std::vector<Eigen::Vector2d>& pixels) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& pixel : pixels) mean += pixel / double(pixels.size());
  double sum = 0;
  for (const Eigen::Vector2d& pixel : pixels) sum += (pixel - mean).squaredNorm();
  return sum * double(pixels.size() - 1) / double(pixels.size());
}

}  // namespace

double jackknifeInflation(const ProjectorEstimate& estimate, const std::vector<ViewEvidence>& views,
                          const std::vector<std::optional<HeldOut>>& held_out) {
  double jackknifed = 0, predicted = 0;
  for (const ViewEvidence& view : views) {
    if (!view.is_used) continue;
    // A few points of each view are enough: the same parameters move them all.
    const std::size_t stride = std::max<std::size_t>(1, view.projected.size() / 10);
    for (std::size_t i = 0; i < view.projected.size(); i += stride) {
      const Eigen::Vector3d p = onBoard(view.projected[i].rays[0], view.T_camera_board);
      const auto full = predictPixel(estimate, p);
      std::vector<Eigen::Vector2d> replicates;
      for (const auto& one : held_out) {
        if (!one) continue;
        const auto pixel = predictPixel(one->without, p);
        if (pixel) replicates.push_back(pixel->pixel);
      }
      if (!full || replicates.size() < 2) continue;
      jackknifed += jackknifeVariance(replicates);
      predicted += full->covariance.trace();
    }
  }
  return predicted > 0 ? std::max(1.0, jackknifed / predicted) : 1;
}

std::vector<std::optional<HeldOut>> leaveOneOut(const ProjectorModel& model,
                                                const std::vector<ViewEvidence>& views,
                                                const RefineSettings& settings, int threads) {
  std::vector<ViewEvidence> kept = views;
  for (std::size_t i = 0; i < views.size(); ++i) {
    kept[i].projected.clear();
    for (const Sighting& tag : views[i].projected) {
      if (!isOutlier(projectedError(model, views[i], tag))) kept[i].projected.push_back(tag);
    }
  }
  std::vector<std::optional<HeldOut>> result(views.size());
  forEachIndex(views.size(), threads, [&](std::size_t left_out) {
    if (!views[left_out].is_used) return;
    ProjectorModel without = model;
    std::vector<ViewEvidence> others = kept;
    others[left_out].is_used = false;
    RefineSettings quick = settings;
    // One view among many hardly moves the other boards, which their printed tags hold.
    quick.free_boards = false;
    quick.free_camera = false;
    quick.iterations = 8;
    refine(without, others, quick);
    ViewEvidence view = kept[left_out];
    refineBoardPose(without, view);
    result[left_out] = measure(without, view);
    result[left_out]->without.projector = without.projector;
    result[left_out]->without.T_camera_projector = without.T_camera_projector;
  });
  return result;
}

}  // namespace afterglow::calib
