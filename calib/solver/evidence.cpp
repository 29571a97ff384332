#include "calib/solver/evidence.hpp"

#include <Eigen/Geometry>
#include <limits>
#include <map>
#include <opencv2/calib3d.hpp>
#include <optional>

namespace afterglow::calib {
namespace {

/// A printed corner further than this from where the other tags put it is not on the board (or not
/// this board); px.
constexpr double kPrintedTolerance_px = 3;

/// No corner is known better than this, whatever the fit says: papers are not flat, cells not
/// exact.
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

/// Leaves those whose four corners lie where one flat board would put them.
void keepCoplanar(std::vector<Sighting>& printed, double focal_px) {
  std::vector<cv::Point2d> on_board, ideal;
  for (const Sighting& tag : printed) {
    for (std::size_t i = 0; i < 4; ++i) {
      on_board.emplace_back(tag.target[i].x(), tag.target[i].y());
      ideal.emplace_back(focal_px * tag.rays[i].x(), focal_px * tag.rays[i].y());
    }
  }
  cv::setRNGSeed(1);
  std::vector<std::uint8_t> fits;
  cv::findHomography(on_board, ideal, cv::RANSAC, kPrintedTolerance_px, fits, 500);
  std::vector<Sighting> kept;
  for (std::size_t i = 0; 4 * i + 3 < fits.size(); ++i) {
    if (fits[4 * i] && fits[4 * i + 1] && fits[4 * i + 2] && fits[4 * i + 3]) {
      kept.push_back(printed[i]);
    }
  }
  printed = kept;
}

/// From all printed corners at once; tags that do not fit are dropped. Empty with fewer than two
/// tags that agree.
std::optional<Rigid<Camera, Surface>> boardPose(std::vector<Sighting>& printed,
                                                const Lens& camera) {
  if (printed.size() >= 2) keepCoplanar(printed, camera.K(0, 0));
  if (printed.size() < 2) return std::nullopt;
  std::vector<cv::Point3d> on_board;
  std::vector<cv::Point2d> rays;
  for (const Sighting& tag : printed) {
    for (std::size_t i = 0; i < 4; ++i) {
      on_board.emplace_back(tag.target[i].x(), tag.target[i].y(), 0);
      rays.emplace_back(tag.rays[i].x(), tag.rays[i].y());
    }
  }
  cv::Mat turn, shift;
  if (!cv::solvePnP(on_board, rays, cv::Matx33d::eye(), cv::noArray(), turn, shift, false,
                    cv::SOLVEPNP_IPPE)) {
    return std::nullopt;
  }
  cv::Matx33d R;
  cv::Rodrigues(turn, R);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) T.linear()(row, column) = R(row, column);
    T.translation()[row] = shift.at<double>(row);
  }
  if (!T.matrix().allFinite() || !(T.translation().z() > 0)) return std::nullopt;
  return Rigid<Camera, Surface>(T);
}

}  // namespace

Eigen::Vector3d onBoard(const Eigen::Vector2d& ray, const Rigid<Camera, Surface>& T_camera_board) {
  const Eigen::Vector3d direction = ray.homogeneous();
  const Eigen::Vector3d normal = T_camera_board.matrix().linear().col(2);
  const double distance = normal.dot(T_camera_board.matrix().translation()) / normal.dot(direction);
  if (!(distance > 0)) {
    return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return distance * direction;
}

std::vector<ViewEvidence> gatherEvidence(const std::vector<View>& views, const Board& board,
                                         const Pattern& pattern, const Lens& camera) {
  std::vector<ViewEvidence> all;
  for (const View& view : views) {
    ViewEvidence evidence;
    evidence.name = view.name;
    evidence.printed = match(view.board, board.tags, camera);
    evidence.projected = match(view.projected, pattern.tags, camera);
    const auto pose = boardPose(evidence.printed, camera);
    if (pose) evidence.T_camera_board = *pose;
    for (const std::string& fault : view.faults) {
      evidence.reason += (evidence.reason.empty() ? "" : "; ") + fault;
    }
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
