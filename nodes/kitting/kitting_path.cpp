#include "nodes/kitting/kitting_path.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

constexpr double kStep = 0.05;      // m between path points
constexpr double kGrow = 0.02;      // m by which a detour is widened until it is clear
constexpr double kWidest = 3.0;     // m; a detour wider than this is none
constexpr double kTurnStep = 0.05;  // rad between the poses of a turn
constexpr double kSpeed = 0.6, kAcceleration = 0.5;          // m/s, m/s^2
constexpr double kTurnSpeed = 1.3, kTurnAcceleration = 2.0;  // rad/s, rad/s^2

// sin^2 leaves and reaches the straight line without a corner.
FloorPath bent(const Eigen::Vector2d& start, const Eigen::Vector2d& goal, double offset) {
  const Eigen::Vector2d along = goal - start;
  const Eigen::Vector2d left = Eigen::Vector2d(-along.y(), along.x()).normalized();
  const int count = std::max(2, static_cast<int>(std::ceil(along.norm() / kStep)));
  FloorPath path;
  for (int i = 0; i <= count; ++i) {
    const double s = static_cast<double>(i) / count;
    const double bend = std::sin(M_PI * s);
    path.push_back(start + along * s + left * offset * bend * bend);
  }
  return path;
}

bool isClear(const FloorPath& path, const std::vector<Eigen::Vector2d>& obstacle,
             double clearance) {
  for (const Eigen::Vector2d& p : path) {
    for (const Eigen::Vector2d& o : obstacle) {
      if ((p - o).norm() < clearance) return false;
    }
  }
  return true;
}

using Samples = std::vector<replay::PoseTrack::Sample>;

/// Goes on through these poses, one every `step` (m or rad), as fast as a motion from rest to rest
/// with these limits is there.
void append(Samples& samples, const std::vector<PlanarPose>& poses, double step, double speed,
            double acceleration) {
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto from_rest = static_cast<double>(std::min(i, poses.size() - 1 - i)) + 0.5;
    const double now = std::min(speed, std::sqrt(2 * acceleration * step * from_rest));
    const auto passed_ns = static_cast<std::int64_t>(step / now * 1e9);
    samples.push_back({{samples.back().stamp.ns + passed_ns}, poses[i]});
  }
}

void appendTurn(Samples& samples, double yaw) {
  const PlanarPose from = samples.back().pose;
  const double way = replay::wrapAngle(yaw - from.yaw);
  const int count = static_cast<int>(std::ceil(std::abs(way) / kTurnStep));
  std::vector<PlanarPose> poses;
  for (int i = 1; i <= count; ++i) poses.push_back({from.x, from.y, from.yaw + way * i / count});
  append(samples, poses, count > 0 ? std::abs(way) / count : 0, kTurnSpeed, kTurnAcceleration);
}

}  // namespace

double lengthOf(const FloorPath& path) {
  double length = 0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).norm();
  return length;
}

FloorPath planDetour(const Eigen::Vector2d& start, const Eigen::Vector2d& goal,
                     const std::vector<Eigen::Vector2d>& obstacle, double clearance) {
  if (!isClear({start, goal}, obstacle, clearance)) {
    throw std::invalid_argument("an obstacle stands where the robot is or wants to go");
  }
  for (double offset = 0; offset < kWidest; offset += kGrow) {
    for (const double side : {offset, -offset}) {
      FloorPath path = bent(start, goal, side);
      if (isClear(path, obstacle, clearance)) return path;
    }
  }
  throw std::invalid_argument("there is no way round the obstacle");
}

Eigen::Vector2d pointAlong(const FloorPath& path, double distance) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector2d step = path[i] - path[i - 1];
    const double length = step.norm();
    if (distance <= length && length > 0) return path[i - 1] + step * (distance / length);
    distance -= length;
  }
  return path.back();
}

double nearestAlong(const FloorPath& path, const Eigen::Vector2d& position) {
  double best = INFINITY, best_along = 0, along = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector2d step = path[i] - path[i - 1];
    const double length = step.norm();
    const double on =
        length > 0 ? std::clamp((position - path[i - 1]).dot(step) / length, 0., length) : 0;
    const double distance = (path[i - 1] + step * (length > 0 ? on / length : 0) - position).norm();
    if (distance < best) best = distance, best_along = along + on;
    along += length;
  }
  return best_along;
}

TimedDrive timedDrive(const FloorPath& path, const PlanarPose& start, double final_yaw,
                      replay::Stamp begin) {
  Samples samples = {{begin, start}};
  appendTurn(samples, headingOf(path[1] - path[0]));
  const replay::Stamp turned = samples.back().stamp;
  std::vector<PlanarPose> poses;
  for (std::size_t i = 1; i < path.size(); ++i) {
    poses.push_back({path[i].x(), path[i].y(), headingOf(path[i] - path[i - 1])});
  }
  append(samples, poses, lengthOf(path) / static_cast<double>(poses.size()), kSpeed, kAcceleration);
  appendTurn(samples, final_yaw);
  return {replay::PoseTrack(std::move(samples), "map", true), turned};
}

}  // namespace afterglow::nodes
