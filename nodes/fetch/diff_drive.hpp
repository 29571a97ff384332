/// \file
/// A Fetch's base, simulated: what /cmd_vel does to it, where it really goes and where its wheels
/// think it went. Source of limits: fetch_bringup's base_controller and robot_controllers'
/// DiffDriveBaseController. Metres, radians, nanoseconds of robot time.
#pragma once

#include <cstdint>
#include <deque>
#include <random>

#include "nodes/fetch/robot_time.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {

using replay::PlanarPose;

/// Of mean 0 and deviation 1: twelve uniform numbers make a good bell, and
/// std::normal_distribution differs between libraries.
double bell(std::mt19937& random);

/// What the base does wrong. The same seed drives the same way.
struct DriveErrors {
  double linear_scale = 1.006;   ///< true distance per distance measured by the wheels
  double angular_scale = 0.994;  ///< the same of turns
  double slip = 0.02;  ///< standard deviation of a wheel's travel in a step, relative to it
  std::uint32_t seed = 1;
  Nanoseconds latency{0};  ///< from a command to its effect
};

class DiffDrive {
 public:
  DiffDrive(const PlanarPose& start, const DriveErrors& errors);

  /// Sets the wanted speed (m/s ahead, rad/s to the left), clamped to the base's limits. Returns
  /// false, and keeps the last one, if a value is not finite.
  bool command(double linear, double angular, Nanoseconds now);
  /// Lets `dt` pass until `now`. Without a command for 0.25 s it brakes.
  void step(Nanoseconds now, Nanoseconds dt);
  /// Stands still at once.
  void halt();
  /// As if somebody had driven it there: the odometry moves along and its drift stays as it was.
  void place(const PlanarPose& true_pose);

  const PlanarPose& truePose() const { return true_pose_; }  ///< in map
  const PlanarPose& odometry() const { return odometry_; }   ///< in odom
  PlanarPose mapToOdom() const;                              ///< the drift: odom in map
  double linear() const { return linear_; }             ///< m/s, as the wheels turn
  double angular() const { return angular_; }           ///< rad/s
  double leftWheel() const { return left_wheel_; }      ///< rad
  double rightWheel() const { return right_wheel_; }    ///< rad

 private:
  struct Command {
    Nanoseconds due;
    double linear, angular;
  };

  void obey(Nanoseconds now);
  double slipFactor();

  DriveErrors errors_;
  std::mt19937 random_;
  std::deque<Command> commands_;  ///< not yet in effect
  PlanarPose true_pose_, odometry_;
  double wanted_linear_ = 0, wanted_angular_ = 0;
  double linear_ = 0, angular_ = 0;
  double left_wheel_ = 0, right_wheel_ = 0;
  Nanoseconds last_command_{0};
};

}  // namespace afterglow::nodes
