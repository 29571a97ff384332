#include "calib/solver/cross_validation.hpp"

#include <algorithm>
#include <cmath>

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
      const auto wanted =
          landingOnSheet(model.projector, tag.target[i], T_projector_board, model.shape);
      const Eigen::Vector3d seen =
          view.T_camera_board.inverse() * onBoard(tag.rays[i], view.T_camera_board, model.shape);
      if (wanted) mm += 1e6 * (seen - *wanted).head<2>().squaredNorm();
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
                                                const Influence& influence, int threads) {
  std::vector<std::optional<HeldOut>> result(views.size());
  forEachIndex(views.size(), threads, [&](std::size_t left_out) {
    if (!views[left_out].is_used) return;
    const ProjectorModel without = movedBy(model, influence.moveWithout(left_out));
    ViewEvidence view = views[left_out];
    view.projected.clear();
    for (const Sighting& tag : views[left_out].projected) {
      if (!isOutlier(projectedError(model, views[left_out], tag))) view.projected.push_back(tag);
    }
    setRays(view, without.camera);
    refineBoardPose(without, view);
    result[left_out] = measure(without, view);
  });
  return result;
}

}  // namespace afterglow::calib
