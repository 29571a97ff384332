#include "nodes/kitting/kitting_path.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

constexpr double kStep = 0.05;           // m between path points
constexpr double kGrow = 0.02;           // m by which a detour is widened until it is clear
constexpr double kWidest = 3.0;          // m; a detour wider than this is none
constexpr double kTurnedEnough = 0.012;  // rad
constexpr double kNearEnough = 0.015;    // m

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

double approach(double from, double to, double step) {
  return from + std::clamp(to - from, -step, step);
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

PathFollower::PathFollower(FloorPath path, double final_yaw, const DriveLimits& limits)
    : path_(std::move(path)), length_(lengthOf(path_)), final_yaw_(final_yaw), limits_(limits) {
  if (path_.size() < 2) throw std::invalid_argument("a path needs two points");
}

PlanarVelocity PathFollower::step(const PlanarPose& pose, double period) {
  switch (phase_) {
    case Phase::TurnToPath: {
      const Eigen::Vector2d heading = pointAlong(path_, limits_.look_ahead) - path_.front();
      last_ = turnTo(std::atan2(heading.y(), heading.x()), pose, period, Phase::Follow);
      break;
    }
    case Phase::Follow:
      last_ = follow(pose, period);
      break;
    case Phase::TurnToGoal:
      last_ = turnTo(final_yaw_, pose, period, Phase::Done);
      break;
    case Phase::Done:
      last_ = {};
      break;
  }
  return last_;
}

PlanarVelocity PathFollower::turnTo(double yaw, const PlanarPose& pose, double period, Phase next) {
  const double left = turnBetween(pose.yaw, yaw);
  if (std::abs(left) < kTurnedEnough) {
    phase_ = next;
    return {};
  }
  // Fast enough to brake in time, with half the braking in reserve for the delay of the loop.
  const double fastest =
      std::min(limits_.turn_speed, std::sqrt(limits_.turn_acceleration * std::abs(left)));
  const double wanted = std::copysign(fastest, left);
  return {0, approach(last_.turn, wanted, limits_.turn_acceleration * period)};
}

PlanarVelocity PathFollower::follow(const PlanarPose& pose, double period) {
  const double along = nearestAlong(path_, positionOf(pose));
  const double remaining = length_ - along;
  if (remaining < kNearEnough) {
    phase_ = Phase::TurnToGoal;
    return {};
  }
  const Eigen::Vector2d to_target =
      pointAlong(path_, along + limits_.look_ahead) - positionOf(pose);
  const double bearing = turnBetween(pose.yaw, std::atan2(to_target.y(), to_target.x()));
  const double wanted = std::min(limits_.speed, std::sqrt(limits_.acceleration * remaining));
  const double forward = approach(last_.forward, wanted, limits_.acceleration * period);
  // Pure pursuit: the arc through the point ahead. Near the end the point is close: turn no
  // sharper.
  const double reach = std::max(to_target.norm(), 0.5 * limits_.look_ahead);
  const double turn = 2 * forward * std::sin(bearing) / reach;
  return {forward, std::clamp(turn, -limits_.turn_speed, limits_.turn_speed)};
}

}  // namespace afterglow::nodes
