/// \file
/// A Fetch's base, simulated: what /cmd_vel does to it, where it really goes, where its wheels
/// think it went and where its localization thinks it is. Source of limits: fetch_bringup's
/// base_controller and robot_controllers' DiffDriveBaseController. Meters, radians, nanoseconds of
/// robot time.
///
/// It is what replays are judged by: it shares no code with what they are led by (replay/motion:
/// tracker, localizer, approach). The pose itself and the arithmetic of poses are common.
#pragma once

#include <cstdint>
#include <deque>
#include <random>

#include "nodes/fetch/joint_controller.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {

using replay::PlanarPose;

/// The errors of the base. The same seed drives the same way.
struct DriveErrors {
  double linear_scale = 1.006;   ///< true distance per distance measured by the wheels
  double angular_scale = 0.994;  ///< the same of turns
  double slip = 0.02;  ///< standard deviation of a wheel's travel in a step, relative to it
  std::uint32_t seed = 1;
  Nanoseconds latency{0};  ///< time from a command to its effect
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
  /// Places the base as if somebody had driven it there: the odometry moves along and its drift
  /// stays as it was.
  void place(const PlanarPose& true_pose);

  const PlanarPose& truePose() const { return true_pose_; }  ///< pose in map
  const PlanarPose& odometry() const { return odometry_; }   ///< pose in odom
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

struct LocalizationErrors {
  /// Standard deviations of a measured pose of the base.
  double position = 0;  ///< m, in x and in y
  double yaw = 0;       ///< rad
  std::uint32_t seed = 2;
  /// The distance and the turn of the wheels before it measures again. Without both it measures
  /// five times a second, and if it is exact as well it always knows.
  double distance = 0.1, turn = 0.25;
};

/// The robot's belief where its odometry's origin lies in map. Measured as AMCL does, on a Fetch
/// after 0.1 m or 0.25 rad of motion only, known 0.1 s later, each time a little beside if told so,
/// and errors that follow each other are alike.
class FakeLocalization {
 public:
  FakeLocalization(const LocalizationErrors& errors, const DiffDrive& base);
  /// Measures where due; called at each of the base's steps.
  void step(Nanoseconds now, const DiffDrive& base);
  /// Somebody tells it where it stands.
  void relocate(const DiffDrive& base);
  const PlanarPose& mapToOdom() const { return known_; }

 private:
  bool isDue(Nanoseconds now, const DiffDrive& base) const;
  PlanarPose measure(const DiffDrive& base);

  struct Measured {
    Nanoseconds known;  ///< moment from which it is known
    PlanarPose map_to_odom;
  };
  LocalizationErrors errors_;
  std::mt19937 random_;
  PlanarPose error_;  ///< error of the latest measurement
  Nanoseconds next_{0};
  PlanarPose measured_at_;  ///< odometry of the latest measurement
  std::deque<Measured> measured_;
  PlanarPose known_;
};

}  // namespace afterglow::nodes
