#include "calib/verify/view_check.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "calib/detection/board_pose.hpp"

namespace afterglow::calib {
namespace {

void addErrors(const SeenTag& seen, const Tag& sent, const Rigid<Camera, Surface>& T_camera_board,
               const Lens& camera, const ProjectorEstimate& estimate, ViewCheck& check) {
  const Rigid<Projector, Surface> T_projector_board =
      estimate.T_camera_projector.inverse() * T_camera_board;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto is_at = landing(camera, seen.corners[i], T_camera_board);
    const auto should_be = landing(estimate.projector, sent.corners[i], T_projector_board);
    if (!is_at || !should_be) continue;
    check.errors.push_back({seen.id, static_cast<int>(i), *should_be, *is_at});
  }
}

}  // namespace

ViewCheck checkView(const View& view, const Board& board, const Pattern& pattern,
                    const Lens& camera, const ProjectorEstimate& estimate) {
  ViewCheck check;
  check.name = view.name;
  check.fault = fmt::format("{}", fmt::join(view.faults, "; "));
  if (!check.fault.empty()) return check;
  const auto pose = boardPose({view.board.begin(), view.board.end()}, board.tags, camera);
  if (!pose) {
    check.fault = "only " + std::to_string(view.board.size()) +
                  " printed tags are seen: no telling where the board is; bring it nearer";
    return check;
  }
  for (const SeenTag& seen : view.projected) {
    const auto sent = std::find_if(pattern.tags.begin(), pattern.tags.end(),
                                   [&](const Tag& tag) { return tag.id == seen.id; });
    if (sent != pattern.tags.end()) {
      addErrors(seen, *sent, pose->T_camera_board, camera, estimate, check);
    }
  }
  if (check.errors.empty()) {
    check.fault = "no tag of the pattern lies on the board; hold it where the pattern falls";
  }
  return check;
}

}  // namespace afterglow::calib
