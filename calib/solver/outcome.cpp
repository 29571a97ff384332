#include "calib/solver/outcome.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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

namespace {

ViewResult blankResult(const ViewEvidence& view) {
  ViewResult result;
  result.name = view.name;
  result.is_used = view.is_used;
  result.reason = view.reason;
  result.T_camera_board = view.T_camera_board;
  return result;
}

/// Returns a corner without errors.
CornerResidual cornerOf(const Sighting& tag, std::size_t i, bool is_projected) {
  CornerResidual corner;
  corner.tag_id = tag.id;
  corner.corner = static_cast<int>(i);
  corner.is_projected = is_projected;
  corner.camera_px = tag.camera_px[i];
  corner.error_px.setZero();
  if (is_projected) corner.pattern_px = tag.target[i];
  return corner;
}

void addSeen(const std::vector<Sighting>& tags, bool is_projected, ViewResult& result) {
  for (const Sighting& tag : tags) {
    for (std::size_t i = 0; i < 4; ++i) result.residuals.push_back(cornerOf(tag, i, is_projected));
  }
}

/// Adds the tag's residuals; returns true if it is an outlier.
bool addResiduals(const ProjectorModel& model, const ViewEvidence& view, const Sighting& tag,
                  bool is_projected, ViewResult& result) {
  const TagError error =
      is_projected ? projectedError(model, view, tag) : printedError(model, view, tag);
  const Rigid<Projector, Surface> T_projector_board =
      model.T_camera_projector.inverse() * view.T_camera_board;
  for (std::size_t i = 0; i < 4; ++i) {
    CornerResidual residual = cornerOf(tag, i, is_projected);
    residual.is_outlier = isOutlier(error);
    const auto on_board =
        is_projected
            ? landingOnSheet(model.projector, tag.target[i], T_projector_board, model.shape)
            : std::optional<Eigen::Vector3d>(model.shape.place(tag.target[i]));
    if (!on_board) continue;
    const auto expected = project(model.camera, view.T_camera_board * *on_board);
    if (!expected) continue;
    residual.error_px = tag.camera_px[i] - *expected;
    if (is_projected) residual.pattern_error_px = error.error.segment<2>(2 * Eigen::Index(i));
    if (residual.pattern_error_px.allFinite()) result.residuals.push_back(residual);
  }
  return isOutlier(error);
}

}  // namespace

ViewResult viewResult(const ProjectorModel& model, const ViewEvidence& view,
                      const std::optional<HeldOut>& held_out) {
  ViewResult result = blankResult(view);
  if (held_out) {
    result.held_out_px = held_out->rms_px;
    result.held_out_mm = held_out->rms_mm;
  }
  double sum = 0;
  int count = 0;
  for (const Sighting& tag : view.printed) addResiduals(model, view, tag, false, result);
  for (const Sighting& tag : view.projected) {
    if (addResiduals(model, view, tag, true, result)) continue;
    sum += projectedError(model, view, tag).error.squaredNorm();
    count += 4;
  }
  if (count > 0) result.projected_rms_px = std::sqrt(sum / count);
  return result;
}

ViewResult viewResult(const ViewEvidence& view) {
  ViewResult result = blankResult(view);
  addSeen(view.printed, false, result);
  addSeen(view.projected, true, result);
  return result;
}

void setErrors(Calibration& calibration, const std::vector<std::optional<HeldOut>>& held_out) {
  const double nothing = std::numeric_limits<double>::infinity();
  double px = 0, mm = 0;
  int corners = 0;
  for (const auto& one : held_out) {
    if (!one) continue;
    px += one->rms_px * one->rms_px * one->corners;
    mm += one->rms_mm * one->rms_mm * one->corners;
    corners += one->corners;
  }
  calibration.held_out_rms_px = corners > 0 ? std::sqrt(px / corners) : nothing;
  calibration.held_out_rms_mm = corners > 0 ? std::sqrt(mm / corners) : nothing;
  double projected = 0, printed = 0;
  int projected_count = 0, printed_count = 0;
  for (const ViewResult& view : calibration.views) {
    if (!view.is_used) continue;
    for (const CornerResidual& residual : view.residuals) {
      if (residual.is_outlier) continue;
      if (residual.is_projected) {
        projected += residual.pattern_error_px.squaredNorm(), ++projected_count;
      } else {
        printed += residual.error_px.squaredNorm(), ++printed_count;
      }
    }
  }
  if (projected_count > 0) calibration.training_rms_px = std::sqrt(projected / projected_count);
  if (printed_count > 0) calibration.board_rms_px = std::sqrt(printed / printed_count);
}

}  // namespace afterglow::calib
