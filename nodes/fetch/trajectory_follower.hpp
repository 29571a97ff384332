/// \file
/// One joint trajectory controller, simulated: what a FollowJointTrajectory goal does to its
/// joints. Semantics of Fetch's robot_controllers (FollowJointTrajectoryController) and, where
/// those are silent, ros_controllers' joint_trajectory_controller. Radians, metres, nanoseconds of
/// robot time.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nodes/fetch/robot_model.hpp"
#include "nodes/fetch/robot_time.hpp"

namespace afterglow::nodes {

struct JointState {
  double position = 0, velocity = 0;
};
using JointStates = std::map<std::string, JointState>;

struct TrajectoryPoint {
  std::vector<double> positions, velocities, accelerations;  ///< the last two may be empty
  Nanoseconds time_from_start{0};
};

/// 0 keeps the controller's default, negative lifts the limit.
struct JointTolerance {
  std::string joint;
  double position = 0;
};

struct TrajectoryGoal {
  Nanoseconds stamp{0};  ///< when it starts; 0: now
  std::vector<std::string> joints;
  std::vector<TrajectoryPoint> points;  ///< none: stop
  std::vector<JointTolerance> path_tolerance, goal_tolerance;
  Nanoseconds goal_time_tolerance{0};  ///< on top of the controller's own 0.6 s
};

/// FollowJointTrajectoryResult's codes.
enum class TrajectoryError {
  None = 0,
  InvalidGoal = -1,
  InvalidJoints = -2,
  OldHeaderTimestamp = -3,
  PathToleranceViolated = -4,
  GoalToleranceViolated = -5,
};

struct TrajectoryStatus {
  enum class Phase { Idle, Running, Succeeded, Failed, Stopped } phase = Phase::Idle;
  TrajectoryError error = TrajectoryError::None;
  std::string text;  ///< one line, where it failed or was stopped
};

/// Degree of interpolation follows what both ends of a segment give: positions a line, velocities a
/// cubic, accelerations a quintic. Not thread safe.
class TrajectoryFollower {
 public:
  explicit TrajectoryFollower(std::vector<Joint> joints) : joints_(std::move(joints)) {}

  const std::vector<Joint>& joints() const { return joints_; }
  bool moves(const std::string& joint) const;

  /// Replaces what was running, from where the joints are and as fast as they are; a goal that is
  /// refused stops what was running. Points before
  /// `now` are dropped; a goal with none left fails with OldHeaderTimestamp. A first point after
  /// the start is reached from the current position; one at the start is jumped to (as fast as the
  /// joints can). Continuous joints take the short way to the first point.
  void start(const TrajectoryGoal& goal, const JointStates& now_at, Nanoseconds now);

  /// Brakes within 0.2 s and gives the goal up.
  void stop(const JointStates& now_at, Nanoseconds now, const std::string& why);

  /// Forgets everything at once, for joints that were moved by hand.
  void drop(const std::string& why);

  /// Moves its joints to `now`, `dt` after the last step, within their velocity and position
  /// limits.
  void step(JointStates& states, Nanoseconds now, Nanoseconds dt);

  const TrajectoryStatus& status() const { return status_; }
  /// Where its joints should be; empty before the first goal.
  const JointStates& desired() const { return desired_; }

 private:
  /// What one joint has to pass, all at the same time.
  struct Knot {
    Nanoseconds time{0};
    std::vector<double> positions, velocities, accelerations;
  };

  TrajectoryStatus check(const TrajectoryGoal& goal) const;
  void takeKnots(const TrajectoryGoal& goal, Nanoseconds begin, const JointStates& now_at,
                 Nanoseconds now);
  void takeTolerances(const TrajectoryGoal& goal);
  void unwind(const JointStates& now_at);
  JointState sample(std::size_t joint, Nanoseconds now) const;
  void end(const TrajectoryStatus& verdict, const JointStates& now_at, Nanoseconds now);
  void judge(const JointStates& states, Nanoseconds now);
  void fail(TrajectoryError error, const std::string& text);

  std::vector<Joint> joints_;
  std::vector<Knot> knots_;
  std::map<std::string, double> path_tolerance_, goal_tolerance_;
  Nanoseconds patience_{0};  ///< after the last knot
  TrajectoryStatus status_;
  JointStates desired_;
};

}  // namespace afterglow::nodes
