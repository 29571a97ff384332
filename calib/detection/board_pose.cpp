#include "calib/detection/board_pose.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <opencv2/calib3d.hpp>

namespace afterglow::calib {
namespace {

constexpr std::size_t kFewestTags = 2;
constexpr double kTolerance_px = 3;

struct Match {
  int id = 0;
  std::array<Eigen::Vector2d, 4> on_board;  ///< m
  std::array<Eigen::Vector2d, 4> rays;      ///< normalized, undistorted
};

std::vector<Match> match(const std::vector<Tag>& seen, const std::vector<Tag>& printed,
                         const Lens& camera) {
  std::map<int, const Tag*> by_id;
  for (const Tag& tag : printed) by_id[tag.id] = &tag;
  std::map<int, int> times;
  for (const Tag& tag : seen) ++times[tag.id];
  std::vector<Match> matches;
  for (const Tag& tag : seen) {
    const auto known = by_id.find(tag.id);
    if (known == by_id.end() || times[tag.id] > 1) continue;
    Match one{tag.id, known->second->corners, {}};
    bool has_rays = true;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto ray = unproject(camera, tag.corners[i]);
      has_rays = has_rays && ray;
      if (ray) one.rays[i] = ray->head<2>();
    }
    if (has_rays) matches.push_back(one);
  }
  return matches;
}

/// The tags whose four corners fit one flat board.
std::vector<Match> coplanar(const std::vector<Match>& matches, double focal_px) {
  std::vector<cv::Point2d> on_board, ideal_px;
  for (const Match& tag : matches) {
    for (std::size_t i = 0; i < 4; ++i) {
      on_board.emplace_back(tag.on_board[i].x(), tag.on_board[i].y());
      ideal_px.emplace_back(focal_px * tag.rays[i].x(), focal_px * tag.rays[i].y());
    }
  }
  cv::setRNGSeed(1);
  std::vector<std::uint8_t> fits;
  cv::findHomography(on_board, ideal_px, cv::RANSAC, kTolerance_px, fits, 500);
  std::vector<Match> kept;
  for (std::size_t i = 0; 4 * i + 3 < fits.size(); ++i) {
    if (fits[4 * i] && fits[4 * i + 1] && fits[4 * i + 2] && fits[4 * i + 3]) {
      kept.push_back(matches[i]);
    }
  }
  return kept;
}

std::optional<Eigen::Isometry3d> solvePose(const std::vector<Match>& matches) {
  std::vector<cv::Point3d> on_board;
  std::vector<cv::Point2d> rays;
  for (const Match& tag : matches) {
    for (std::size_t i = 0; i < 4; ++i) {
      on_board.emplace_back(tag.on_board[i].x(), tag.on_board[i].y(), 0);
      rays.emplace_back(tag.rays[i].x(), tag.rays[i].y());
    }
  }
  const cv::Matx33d pinhole = cv::Matx33d::eye();
  cv::Mat turn, shift;
  if (!cv::solvePnP(on_board, rays, pinhole, cv::noArray(), turn, shift, false,
                    cv::SOLVEPNP_IPPE)) {
    return std::nullopt;
  }
  cv::solvePnPRefineLM(on_board, rays, pinhole, cv::noArray(), turn, shift);
  cv::Matx33d R;
  cv::Rodrigues(turn, R);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) T.linear()(row, column) = R(row, column);
    T.translation()(row) = shift.at<double>(row);
  }
  return T;
}

bool facesCamera(const Eigen::Isometry3d& T_camera_board) {
  return T_camera_board.matrix().allFinite() && T_camera_board.translation().z() > 0 &&
         T_camera_board.linear().col(2).dot(T_camera_board.translation()) < 0;
}

}  // namespace

std::optional<BoardPose> boardPose(const std::vector<Tag>& seen, const std::vector<Tag>& printed,
                                   const Lens& camera) {
  std::vector<Match> matches = match(seen, printed, camera);
  if (matches.size() >= kFewestTags) matches = coplanar(matches, camera.K(0, 0));
  if (matches.size() < kFewestTags) return std::nullopt;
  const auto T = solvePose(matches);
  if (!T || !facesCamera(*T)) return std::nullopt;
  BoardPose pose{Rigid<Camera, Surface>(*T), {}};
  for (const Match& tag : matches) pose.ids.insert(tag.id);
  return pose;
}

}  // namespace afterglow::calib
