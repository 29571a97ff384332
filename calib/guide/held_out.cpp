#include "calib/guide/held_out.hpp"

#include <algorithm>
#include <cmath>

#include "calib/guide/board_pose.hpp"

namespace afterglow::calib {
namespace {

/// Where a ray of the camera's frame meets the board; empty if it does not.
std::optional<Eigen::Vector3d> onBoard(const Rigid<Camera, Surface>& T_camera_board,
                                       const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
  const Eigen::Vector3d normal = T_camera_board.matrix().linear().col(2);
  const double slope = normal.dot(ray);
  if (std::abs(slope) < 1e-9) return std::nullopt;
  const double way = normal.dot(T_camera_board.matrix().translation() - origin) / slope;
  if (way <= 0) return std::nullopt;
  return Eigen::Vector3d(origin + way * ray);
}

}  // namespace

std::optional<HeldOutError> heldOutError(const View& view, const Board& board,
                                         const Pattern& pattern, const Lens& camera,
                                         const ProjectorEstimate& estimate) {
  const auto T_camera_board = boardPose({view.board.begin(), view.board.end()}, board, camera);
  if (!T_camera_board) return std::nullopt;
  const Eigen::Isometry3d& T_camera_projector = estimate.T_camera_projector.matrix();
  HeldOutError error;
  for (const SeenTag& seen : view.projected) {
    const auto sent = std::find_if(pattern.tags.begin(), pattern.tags.end(),
                                   [&](const Tag& tag) { return tag.id == seen.id; });
    if (sent == pattern.tags.end()) continue;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto sight = unproject(camera, seen.corners[i]);
      const auto beam = unproject(estimate.projector, sent->corners[i]);
      if (!sight || !beam) continue;
      const auto is_at = onBoard(*T_camera_board, Eigen::Vector3d::Zero(), *sight);
      const auto should_be = onBoard(*T_camera_board, T_camera_projector.translation(),
                                     T_camera_projector.linear() * *beam);
      if (!is_at || !should_be) continue;
      const auto pixel = project(estimate.projector, T_camera_projector.inverse() * *is_at);
      if (!pixel) continue;
      const double mm = 1000 * (*is_at - *should_be).norm();
      error.rms_mm += mm * mm;
      error.rms_px += (*pixel - sent->corners[i]).squaredNorm();
      error.worst_mm = std::max(error.worst_mm, mm);
      ++error.corners;
    }
  }
  if (error.corners == 0) return std::nullopt;
  error.rms_mm = std::sqrt(error.rms_mm / error.corners);
  error.rms_px = std::sqrt(error.rms_px / error.corners);
  return error;
}

}  // namespace afterglow::calib
