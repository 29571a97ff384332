/// \file
/// A joint trajectory controller, simulated: what a FollowJointTrajectory goal does to its joints.
/// Semantics of robot_controllers' FollowJointTrajectoryController (melodic-devel), as impolite as
/// it is. Radians, meters, nanoseconds of robot time.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "nodes/fetch/joint_controller.hpp"

namespace afterglow::nodes {

struct TrajectoryPoint {
  std::vector<double> positions, velocities, accelerations;  ///< the last two may be empty
  Nanoseconds time_from_start{0};
};

struct JointTolerance {
  std::string joint;
  double position = 0;  ///< 0 or less: anything goes
};

struct TrajectoryGoal {
  Nanoseconds stamp{0};  ///< time of the start; 0: now
  std::vector<std::string> joints;
  std::vector<TrajectoryPoint> points;  ///< points of the trajectory; empty: let go
  /// Tolerances of all joints; those of some do not count.
  std::vector<JointTolerance> path_tolerance, goal_tolerance;
  Nanoseconds goal_time_tolerance{0};  ///< time on top of the controller's own 0.6 s
};

/// A goal's points, from `begin` on, in the order of a controller's joints, all of which it has.
std::vector<JointKnot> knotsOf(const TrajectoryGoal& goal, const std::vector<Joint>& joints,
                               Nanoseconds begin);

class TrajectoryFollower : public JointController {
 public:
  explicit TrajectoryFollower(std::vector<Joint> joints) : JointController(std::move(joints)) {}

  /// A goal, after what was under way has been canceled. It begins
  /// - after a cancel at the last command and its time: what has passed since then is made good
  ///   within one cycle;
  /// - else where the joints are, if its first point comes later than now, or is its only one;
  /// - else at its first point: the command steps there.
  /// A stamp in the past is not refused: the command steps to where the trajectory stands by now.
  /// A goal without points has the controller let go; one that is refused (for other joints than
  /// its own) leaves it as it was. To be followed by begin() or refuse() if it isBusy().
  /// One thing is kinder than on the robot: values that are missing, not finite or go back in time
  /// are refused.
  void start(const TrajectoryGoal& goal, const JointStates& measured, Nanoseconds now);

 private:
  bool check(const TrajectoryGoal& goal);
  bool checkPoints(const TrajectoryGoal& goal);
  std::optional<std::vector<double>> limitsOf(const std::vector<JointTolerance>& tolerances,
                                              double otherwise);
  bool takeTolerances(const TrajectoryGoal& goal);
  void judge(const JointStates& measured, Nanoseconds now) override;

  std::vector<double> path_limits_, goal_limits_;  ///< limits by joint; 0 or less: none
  Nanoseconds patience_{0};                        ///< time after the last point
};

}  // namespace afterglow::nodes
