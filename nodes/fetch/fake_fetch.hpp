/// \file
/// A Fetch in a computer: its controllers, base and gripper, without ROS. Robot time drives it.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "nodes/fetch/diff_drive.hpp"
#include "nodes/fetch/fake_localization.hpp"
#include "nodes/fetch/robot_model.hpp"
#include "nodes/fetch/trajectory_follower.hpp"

namespace afterglow::nodes {

struct FakeFetchConfig {
  Pose2 start;  ///< of base_link in map
  DriveErrors errors;
  LocalizationErrors localization{};
  double slowness = 1;  ///< joint trajectories take so many times as long as their goals say
};

/// The controllers that follow joint trajectories, by the names of their ROS namespaces; those that
/// share a joint stop each other, as the robot's controller manager has it.
constexpr const char* kArmWithTorsoController = "arm_with_torso_controller";
constexpr const char* kTorsoController = "torso_controller";
constexpr const char* kHeadController = "head_controller";
constexpr const char* kProjectorController = "projector";
constexpr const char* kPointHeadController = "point_head";

struct GripperStatus {
  double gap = 0;  ///< between the pads
  bool reached = true;
};

/// Not thread safe: the node holds a lock. Steps of 10 ms; unknown controller names throw
/// std::out_of_range.
class FakeFetch {
 public:
  FakeFetch(RobotModel model, const FakeFetchConfig& config, Nanoseconds now);

  /// Brings the robot to `now`. A clock that jumps, back or more than 10 s ahead, stops everything.
  void step(Nanoseconds now);

  void follow(const std::string& controller, const TrajectoryGoal& goal);
  /// Turns the head so that the camera looks at p_base, in at least `duration` and no faster than
  /// `max_velocity` (0: as the joints can). Returns false if the head cannot look there.
  bool pointHead(const Eigen::Vector3d& p_base, Nanoseconds duration, double max_velocity);
  void stop(const std::string& controller);
  const TrajectoryFollower& controller(const std::string& name) const;

  /// Opens or closes to `gap` metres, clamped to 0..0.1.
  void moveGripper(double gap);
  void stopGripper();
  GripperStatus gripper() const;

  bool drive(double linear, double angular) { return base_.command(linear, angular, now_); }

  /// Back to the start pose and joints, everything stopped: as if a person had put it there.
  void reset();

  const RobotModel& model() const { return model_; }
  const DiffDrive& base() const { return base_; }
  const Pose2& mapToOdom() const { return localization_.mapToOdom(); }  ///< as it is believed
  const JointStates& joints() const { return joints_; }
  JointPositions jointPositions() const;
  Nanoseconds now() const { return now_; }

 private:
  void stepOnce();
  void stopEverything(const std::string& why);
  void takeJointsFrom(const TrajectoryFollower& taker, const std::string& taker_name);
  TrajectoryFollower& follower(const std::string& name);
  void moveFingers();
  void turnWheels();

  RobotModel model_;
  FakeFetchConfig config_;
  DiffDrive base_;
  FakeLocalization localization_;
  JointStates joints_;
  std::map<std::string, TrajectoryFollower> followers_;
  double wanted_gap_ = 0;
  Nanoseconds now_;
};

}  // namespace afterglow::nodes
