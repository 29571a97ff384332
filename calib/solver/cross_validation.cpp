#include "calib/solver/cross_validation.hpp"

#include <cmath>

#include "calib/parallel.hpp"
#include "calib/verify/landing.hpp"

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

}  // namespace

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
  });
  return result;
}

}  // namespace afterglow::calib
