/// \file
/// A Fetch in a computer: its controllers, base and gripper, without ROS. Robot time drives it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nodes/fetch/fake_base.hpp"
#include "nodes/fetch/joint_controller.hpp"
#include "nodes/fetch/robot_model.hpp"

namespace afterglow::nodes {

struct FakeFetchConfig {
  PlanarPose start;  ///< pose of base_link in map
  DriveErrors errors;
  LocalizationErrors localization{};
  double slowness = 1;  ///< joint trajectories take so many times as long as their goals say
};

/// The controllers that follow joint trajectories, by the names of their ROS namespaces; those that
/// share a joint exclude each other, as the robot's controller manager has it.
constexpr const char* kArmController = "arm_controller";
constexpr const char* kArmWithTorsoController = "arm_with_torso_controller";
constexpr const char* kTorsoController = "torso_controller";
constexpr const char* kHeadController = "head_controller";
constexpr const char* kProjectorController = "projector";
constexpr const char* kPointHeadController = "point_head";

/// The status of ParallelGripperController's latest goal.
struct GripperStatus {
  double gap = 0;  ///< distance between the pads
  bool is_done = true;
  bool reached = false;  ///< true within 2 mm
  bool stalled = false;  ///< less than 5 mm in 2 s: good enough for this controller
};

/// The commands to the joints, for judges: a step is a jolt on a real robot.
struct JointCommands {
  JointPositions positions;  ///< positions in the latest cycle; a joint that is missing is limp
  /// The largest steps from one cycle to the next, or from where a limp joint was.
  JointPositions largest_steps;
};

/// Not thread safe: the node holds a lock. Steps of 10 ms; unknown controller names throw
/// std::out_of_range.
class FakeFetch {
 public:
  FakeFetch(RobotModel model, const FakeFetchConfig& config, Nanoseconds now);

  /// Brings the robot to `now`. A clock that jumps, back or more than 10 s ahead, stops everything.
  void step(Nanoseconds now);

  /// A controller that shares joints and is busy with them keeps them: the new goal fails. One
  /// that only holds them gives them up.
  void follow(const std::string& controller, const TrajectoryGoal& goal);
  /// Turns the head toward p_base as PointHeadController reckons it: pan about the torso's frame,
  /// tilt about head_pan_link's, and the camera, which sits beside both, is not asked.
  void pointHead(const Eigen::Vector3d& p_base, Nanoseconds duration, double max_velocity);
  void cancel(const std::string& controller);
  const JointController& controller(const std::string& name) const;

  /// Opens or closes to `gap` meters, clamped to 0..0.1. Nothing but another goal stops it: on a
  /// cancel the fingers go on.
  void moveGripper(double gap);
  GripperStatus gripper() const;

  /// Somebody switches the controllers of these joints off (on the robot: joystick button 4), which
  /// aborts their goals, and moves the joints there at 1 rad/s. A controller that begins takes them
  /// out of the hand.
  void moveByHand(const JointPositions& positions);
  /// Since the last call.
  JointCommands takeCommands();

  /// The power is cut: base and joints stay where they are, goals fail.
  void cutPower() { stopEverything("the runstop was pressed"); }

  bool drive(double linear, double angular) { return base_.command(linear, angular, now_); }

  /// Back to the start pose and joints, everything stopped: as if a person had put it there.
  void reset();

  const RobotModel& model() const { return model_; }
  const DiffDrive& base() const { return base_; }
  /// The pose as it is believed.
  const PlanarPose& mapToOdom() const { return localization_.mapToOdom(); }
  const JointStates& joints() const { return joints_; }
  JointPositions jointPositions() const;
  Nanoseconds now() const { return now_; }

 private:
  void stepOnce();
  void stopEverything(const std::string& why);
  void startController(JointController& taker);
  TrajectoryFollower& follower(const std::string& name);
  std::vector<JointController*> controllers();
  void obey(const JointController& controller, const std::vector<double>& positions,
            const JointPositions& before);
  void moveHandled();
  void moveFingers();
  void watchGrip();
  void turnWheels();

  RobotModel model_;
  FakeFetchConfig config_;
  DiffDrive base_;
  FakeLocalization localization_;
  JointStates joints_;
  std::map<std::string, TrajectoryFollower> followers_;
  HeadPointer head_pointer_;
  JointPositions in_hand_;  ///< positions to which somebody is moving joints
  JointCommands commands_;
  double wanted_gap_ = 0, goal_gap_ = 0;
  GripperStatus grip_;
  double watched_gap_ = 0;  ///< the gripper stalls if it stays near
  Nanoseconds watched_since_{0};
  Nanoseconds now_;
};

}  // namespace afterglow::nodes
