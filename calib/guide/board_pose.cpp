#include "calib/guide/board_pose.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>

namespace afterglow::calib {
namespace {

constexpr std::size_t kFewestTags = 2;

struct Matches {
  std::vector<cv::Point3d> on_board;   ///< m
  std::vector<cv::Point2d> on_camera;  ///< normalized, undistorted
};

Matches match(const std::vector<Tag>& seen, const Board& board, const Lens& camera) {
  std::map<int, int> times;
  for (const Tag& tag : seen) ++times[tag.id];
  Matches matches;
  for (const Tag& tag : seen) {
    const auto printed = std::find_if(board.tags.begin(), board.tags.end(),
                                      [&](const Tag& other) { return other.id == tag.id; });
    if (printed == board.tags.end() || times[tag.id] > 1) continue;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::optional<Eigen::Vector3d> ray = unproject(camera, tag.corners[i]);
      if (!ray) continue;
      matches.on_board.emplace_back(printed->corners[i].x(), printed->corners[i].y(), 0);
      matches.on_camera.emplace_back(ray->x(), ray->y());
    }
  }
  return matches;
}

}  // namespace

std::optional<Rigid<Camera, Surface>> boardPose(const std::vector<Tag>& seen, const Board& board,
                                                const Lens& camera) {
  const Matches matches = match(seen, board, camera);
  if (matches.on_board.size() < 4 * kFewestTags) return std::nullopt;
  const cv::Matx33d pinhole = cv::Matx33d::eye();
  cv::Mat turn, shift;
  if (!cv::solvePnP(matches.on_board, matches.on_camera, pinhole, cv::noArray(), turn, shift, false,
                    cv::SOLVEPNP_IPPE)) {
    return std::nullopt;
  }
  cv::solvePnPRefineLM(matches.on_board, matches.on_camera, pinhole, cv::noArray(), turn, shift);
  cv::Matx33d R;
  cv::Rodrigues(turn, R);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) T.linear()(row, column) = R(row, column);
    T.translation()(row) = shift.at<double>(row);
  }
  const bool is_in_front = T.matrix().allFinite() && T.translation().z() > 0;
  if (!is_in_front || T.linear().col(2).dot(T.translation()) >= 0) return std::nullopt;
  return Rigid<Camera, Surface>(T);
}

Eigen::Vector2d boardTilt(const Rigid<Camera, Surface>& T_camera_board) {
  const Eigen::Vector3d normal = T_camera_board.matrix().linear().col(2);
  const Eigen::Vector3d to_camera = -T_camera_board.matrix().translation().normalized();
  const Eigen::Vector3d right = (Eigen::Vector3d::UnitX() - to_camera.x() * to_camera).normalized();
  const Eigen::Vector3d down = right.cross(to_camera);
  const auto angle = [](double sine) { return std::asin(std::clamp(sine, -1.0, 1.0)); };
  return {angle(normal.dot(right)), angle(normal.dot(down))};
}

}  // namespace afterglow::calib
