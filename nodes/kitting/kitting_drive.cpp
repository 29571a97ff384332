#include "nodes/kitting/kitting_drive.hpp"

#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <cmath>

#include "nodes/kitting/kitting_messages.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kNearestLight = 0.9;  // m ahead: the turret does not point at the robot's own feet
constexpr double kHeadSeconds = 1.0;

}  // namespace

KittingDrive::KittingDrive(const DrivePlan& plan, KittingRobot& robot, const World& world,
                           Callbacks callbacks)
    : plan_(plan), robot_(robot), world_(world), callbacks_(std::move(callbacks)) {}

void KittingDrive::run() {
  robot_.startHead(0, plan_.head_tilt, kHeadSeconds);
  perceiveAndPlan();
  begin_ = ros::Time::now();
  PlanarVelocity command;
  ros::Time tick = begin_;
  while (follower_->phase() != PathFollower::Phase::Done) {
    const PlanarPose pose = robot_.floorPose();
    const PathFollower::Phase before = follower_->phase();
    if (elapsed() >= plan_.perceive) command = follower_->step(pose, 1 / plan_.command_hz);
    robot_.drive(command);
    if (follower_->phase() != before) tellOfPhase(before);
    tellWhatIsDue(pose);
    showWhatIsDue();
    aimAhead(command);
    tick += ros::Duration(1 / plan_.command_hz);
    sleepFor((tick - ros::Time::now()).toSec());
  }
  robot_.stop();
}

void KittingDrive::perceiveAndPlan() {
  const Eigen::Isometry3d T_map_laser = robot_.T_map_link("laser_link");
  const std::vector<float> ranges = scanObstacles(world_, T_map_laser, laser_);
  std::vector<Eigen::Vector2d> obstacle;
  for (const Eigen::Vector3d& p : scanPoints(ranges, T_map_laser, laser_)) {
    obstacle.push_back(p.head<2>());
    p_obstacle_ += p.head<2>();
  }
  if (obstacle.empty()) throw TaskError("the laser sees nothing to drive round");
  p_obstacle_ /= static_cast<double>(obstacle.size());
  try {
    path_ = planDetour(positionOf(robot_.floorPose()), positionOf(plan_.goal), obstacle,
                       plan_.clearance);
  } catch (const std::invalid_argument& error) {
    throw TaskError(error.what());
  }
  follower_.emplace(path_, plan_.goal.yaw, plan_.limits);
}

void KittingDrive::tellOfPhase(PathFollower::Phase before) {
  using Phase = PathFollower::Phase;
  if (before == Phase::TurnToPath) callbacks_.on_moment("rotate");
  if (before == Phase::Follow) callbacks_.on_moment("reach position");
  if (before == Phase::TurnToGoal) callbacks_.on_moment("reach orientation");
  next_aim_ = ros::Time::now();
}

void KittingDrive::tellWhatIsDue(const PlanarPose& pose) {
  if (!has_spoken_ && elapsed() >= plan_.says_after) {
    has_spoken_ = true;
    callbacks_.say();
  }
  if (!has_passed_ &&
      nearestAlong(path_, positionOf(pose)) > nearestAlong(path_, path_.back()) / 2) {
    has_passed_ = true;
    callbacks_.on_moment("detour");
  }
}

void KittingDrive::showWhatIsDue() {
  const ros::Time now = ros::Time::now();
  if (now >= next_scan_) {
    next_scan_ = now + ros::Duration(1 / plan_.scan_hz);
    const auto ranges = scanObstacles(world_, robot_.T_map_link("laser_link"), laser_);
    robot_.projectScan(laserScan("laser_link", now, laser_, ranges));
  }
  if (now >= next_path_) {
    next_path_ = now + ros::Duration(plan_.path_seconds);
    robot_.projectPath(pathMarkers("map", path_, plan_.arrows));
  }
}

// Points where the robot will want to light when the turret gets there.
void KittingDrive::aimAhead(const PlanarVelocity& command) {
  if (ros::Time::now() < next_aim_) return;
  next_aim_ = ros::Time::now() + ros::Duration(plan_.aim_seconds);
  const PlanarPose pose = robot_.floorPose();
  const double yaw = pose.yaw + command.turn * plan_.aim_seconds;
  const Eigen::Vector2d forward(std::cos(yaw), std::sin(yaw));
  const Eigen::Vector2d position =
      positionOf(pose) + forward * command.forward * plan_.aim_seconds;
  const Eigen::Vector2d way = pointToLight(position) - position;
  const double distance = std::max(kNearestLight, way.norm());
  const double bearing = way.norm() < 0.1 ? 0 : turnBetween(yaw, std::atan2(way.y(), way.x()));
  robot_.aimProjector({distance * std::cos(bearing), distance * std::sin(bearing), 0},
                      plan_.aim_seconds, plan_.aim_widest);
}

// The path ahead and, until it is passed, the obstacle beside it.
Eigen::Vector2d KittingDrive::pointToLight(const Eigen::Vector2d& position) const {
  const double along = nearestAlong(path_, position);
  const Eigen::Vector2d ahead = pointAlong(path_, along + plan_.aim_ahead);
  const bool is_passed = nearestAlong(path_, p_obstacle_) < along + kNearestLight / 2;
  return is_passed ? ahead : Eigen::Vector2d((2 * ahead + p_obstacle_) / 3);
}

void KittingDrive::clearLight() {
  visualization_msgs::MarkerArray none;
  none.markers.resize(1);
  none.markers[0].header.frame_id = "map";
  none.markers[0].action = visualization_msgs::Marker::DELETEALL;
  robot_.projectPath(none);
  robot_.projectScan(laserScan("laser_link", ros::Time::now(), laser_, {}));
  robot_.startHead(0, 0, kHeadSeconds);
}

}  // namespace afterglow::nodes
