/// \file
/// The demo's navigation: a path round what the laser saw, and a follower that turns it into wheel
/// commands. Pure, no ROS. Frame: `map`; metres, radians, seconds.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "nodes/fetch/joint_path.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {

using replay::PlanarPose, replay::PlanarVelocity;

inline Eigen::Vector2d positionOf(const PlanarPose& pose) { return {pose.x, pose.y}; }

using FloorPath = std::vector<Eigen::Vector2d>;

double lengthOf(const FloorPath& path);

/// A path from start to goal with a point about every 5 cm: straight, or bent to the side that
/// needs less of a detour so that it stays `clearance` from every obstacle point. It leaves and
/// reaches its ends straight. Throws std::invalid_argument if an end is itself within `clearance`.
FloorPath planDetour(const Eigen::Vector2d& start, const Eigen::Vector2d& goal,
                     const std::vector<Eigen::Vector2d>& obstacle, double clearance);

/// The point `distance` along the path, or its end.
Eigen::Vector2d pointAlong(const FloorPath& path, double distance);

/// How far along the path its point nearest to `position` is.
double nearestAlong(const FloorPath& path, const Eigen::Vector2d& position);

/// The arrows that show a path on the floor, metres.
struct PathMarkerStyle {
  double spacing = 0.1;                           ///< an arrow's length, and the gap to the next
  double shaft = 0.06, head = 0.08, goal = 0.12;  ///< diameters; `goal` of the sphere at the end
};

struct DriveLimits {
  double speed = 0.6, acceleration = 0.6;          ///< m/s, m/s^2
  double turn_speed = 1.3, turn_acceleration = 2;  ///< rad/s, rad/s^2
  double look_ahead = 0.35;                        ///< m
};

/// Turns to the path, follows it, turns to the final heading. Closed loop: tell it where the robot
/// is, at a steady rate.
class PathFollower {
 public:
  enum class Phase { TurnToPath, Follow, TurnToGoal, Done };

  /// The path must have at least two points (std::invalid_argument).
  PathFollower(FloorPath path, double final_yaw, const DriveLimits& limits);

  /// The command for the next `period` seconds; zero once done.
  PlanarVelocity step(const PlanarPose& pose, double period);
  Phase phase() const { return phase_; }

 private:
  PlanarVelocity turnTo(double yaw, const PlanarPose& pose, double period, Phase next);
  PlanarVelocity follow(const PlanarPose& pose, double period);

  FloorPath path_;
  double length_;
  double final_yaw_;
  DriveLimits limits_;
  Phase phase_ = Phase::TurnToPath;
  PlanarVelocity last_;
};

}  // namespace afterglow::nodes
