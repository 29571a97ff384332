#include "calib/solver/evidence.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "calib/detection/board_pose.hpp"

namespace afterglow::calib {
namespace {

/// No corner is more accurate than this, whatever its fit: paper is not flat, cells are not exact.
constexpr double kFloor_px = 0.005;

std::vector<Sighting> match(const std::vector<SeenTag>& seen, const std::vector<Tag>& targets,
                            const Lens& camera) {
  std::map<int, const Tag*> by_id;
  for (const Tag& tag : targets) by_id[tag.id] = &tag;
  std::vector<Sighting> sightings;
  for (const SeenTag& tag : seen) {
    const auto target = by_id.find(tag.id);
    if (target == by_id.end()) continue;
    Sighting sighting;
    sighting.id = tag.id;
    sighting.target = target->second->corners;
    sighting.camera_px = tag.corners;
    sighting.covariance = tag.covariance + kFloor_px * kFloor_px * Matrix8::Identity();
    bool has_rays = true;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto ray = unproject(camera, tag.corners[i]);
      has_rays = has_rays && ray;
      if (ray) sighting.rays[i] = ray->head<2>();
    }
    if (has_rays) sightings.push_back(sighting);
  }
  return sightings;
}

void keepOnly(const std::set<int>& ids, std::vector<Sighting>& tags) {
  const auto end = std::remove_if(tags.begin(), tags.end(),
                                  [&](const Sighting& tag) { return ids.count(tag.id) == 0; });
  tags.erase(end, tags.end());
}

}  // namespace

void setRays(ViewEvidence& view, const Lens& camera) {
  for (std::vector<Sighting>* sightings : {&view.printed, &view.projected}) {
    for (Sighting& sighting : *sightings) {
      for (std::size_t i = 0; i < 4; ++i) {
        const auto ray = unproject(camera, sighting.camera_px[i]);
        sighting.rays[i] = ray ? Eigen::Vector2d(ray->head<2>())
                               : Eigen::Vector2d(Eigen::Vector2d::Constant(std::nan("")));
      }
    }
  }
}

Eigen::Vector3d onBoard(const Eigen::Vector2d& ray, const Rigid<Camera, Surface>& T_camera_board,
                        const BoardShape& shape) {
  return meetSheet(Eigen::Vector3d::Zero(), ray.homogeneous(), T_camera_board.matrix(), shape);
}

std::vector<ViewEvidence> gatherEvidence(const std::vector<View>& views, const Board& board,
                                         const Pattern& pattern, const Lens& camera) {
  std::vector<ViewEvidence> all;
  for (const View& view : views) {
    ViewEvidence evidence;
    evidence.name = view.name;
    evidence.printed = match(view.board, board.tags, camera);
    evidence.projected = match(view.projected, pattern.tags, camera);
    const auto pose = boardPose({view.board.begin(), view.board.end()}, board.tags, camera);
    if (pose) {
      evidence.T_camera_board = pose->T_camera_board;
      keepOnly(pose->ids, evidence.printed);
    }
    evidence.reason = fmt::format("{}", fmt::join(view.faults, "; "));
    if (evidence.reason.empty() && !pose) {
      evidence.reason =
          "the printed tags do not lie as on the board: another layout, or a bent board";
    }
    if (evidence.reason.empty() && evidence.projected.empty()) {
      evidence.reason = "no projected tag lies on the board: hold it in the light";
    }
    evidence.is_used = evidence.reason.empty();
    all.push_back(evidence);
  }
  return all;
}

}  // namespace afterglow::calib
