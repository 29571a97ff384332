/// \file
/// The common part of Fetch's controllers of joints, simulated: a goal, a command in every cycle, a
/// cancel, and the controller manager's word. Semantics of robot_controllers (melodic-devel) and
/// its faults, which a player has to bear: issue 33, a goal that follows a cancel begins at the
/// last command and its old time. Radians, meters, nanoseconds of robot time.
///
/// A joint trajectory controller, simulated: what a FollowJointTrajectory goal does to its joints.
/// Semantics of robot_controllers' FollowJointTrajectoryController (melodic-devel), as impolite as
/// it is. Radians, meters, nanoseconds of robot time.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/fetch/robot_model.hpp"

namespace afterglow::nodes {

using Nanoseconds = std::chrono::nanoseconds;  ///< a duration, or robot time since the epoch

inline double seconds(Nanoseconds duration) {
  return std::chrono::duration<double>(duration).count();
}

/// Positions that joints pass, all at the same time, or are commanded at a time.
struct JointKnot {
  Nanoseconds time{0};
  std::vector<double> positions, velocities, accelerations;  ///< the last two may be empty
};

/// The commands of a simulated controller to its joints over time. Manners of Fetch's
/// robot_controllers (melodic-devel): SplineTrajectorySampler, windupTrajectory.
class JointPath {
 public:
  JointPath() = default;
  /// Two knots or more, as they come: neither their order in time nor what lies between them is
  /// questioned. Continuous joints take the short way from knot to knot.
  JointPath(std::vector<JointKnot> knots, const std::vector<Joint>& joints);

  /// Degree of interpolation follows what a segment's first knot has: positions a line, velocities
  /// a cubic, accelerations a quintic. After the end, the end; empty before the beginning.
  /// Continuous joints within half a turn of 0.
  std::optional<JointKnot> sample(Nanoseconds now) const;
  Nanoseconds end() const { return knots_.back().time; }

 private:
  std::vector<JointKnot> knots_;
  std::vector<bool> turns_for_ever_;
};

/// The short way from one angle to another, in [-pi, pi].
double turnBetween(double from, double to);

struct JointState {
  double position = 0, velocity = 0;
};
using JointStates = std::map<std::string, JointState>;

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
  std::string text;  ///< a line, where it failed or was stopped
};

/// Either off, its joints are limp then (gravity compensation only), or on: it follows a goal or
/// holds its last command until another controller takes the joints. Not thread safe.
class JointController {
 public:
  explicit JointController(std::vector<Joint> joints) : joints_(std::move(joints)) {}
  virtual ~JointController() = default;

  const std::vector<Joint>& joints() const { return joints_; }
  bool moves(const std::string& joint) const;
  const TrajectoryStatus& status() const { return status_; }
  bool isBusy() const { return status_.phase == TrajectoryStatus::Phase::Running; }
  bool isOn() const { return is_on_; }
  /// Returns the latest command; empty before the first.
  JointStates desired() const;

  /// A cancel, or a new goal's arrival: the last command is held at once, without a ramp, and the
  /// next goal begins there, at its time.
  void cancel();
  /// Returns the command of this cycle, in the order of joints(); empty: the joints are left alone.
  std::optional<std::vector<double>> step(const JointStates& measured, Nanoseconds now);

  // --------------------------------------------------------------- from the controller manager
  /// A goal was taken, and its joints are free.
  void begin();
  /// A goal was taken, but another controller is busy with its joints.
  void refuse(const std::string& why);
  /// Another controller takes its joints. Not while it is busy.
  void yield() { is_on_ = false; }
  /// Lets go by force: its goal is aborted, its joints are limp. What it commanded last is
  /// remembered.
  void letGo(const std::string& why);
  /// Forgets all, as after a restart of the robot.
  void forget(const std::string& why);

 protected:
  void fail(TrajectoryError error, const std::string& why);
  void take(JointPath path);
  /// Judges in every cycle whether the goal under way has ended.
  virtual void judge(const JointStates& measured, Nanoseconds now) = 0;

  const JointPath& path() const { return path_; }
  void succeed() { status_ = {TrajectoryStatus::Phase::Succeeded, TrajectoryError::None, ""}; }
  /// Returns how far a joint is from its command, the short way round.
  double off(const JointStates& measured, std::size_t joint) const;
  /// Returns the joints' positions, at rest.
  JointKnot here(const JointStates& measured, Nanoseconds now) const;
  /// Returns the begin of a goal that follows a cancel; empty for any other.
  std::optional<JointKnot> spliceKnot() const;

 private:
  std::vector<Joint> joints_;
  JointPath path_;
  TrajectoryStatus status_;
  std::optional<JointKnot> last_command_;
  bool is_on_ = false, was_canceled_ = false;
};

/// The controller that points the head. Semantics of robot_controllers' PointHead (melodic-devel),
/// with its fault: after a cancel (issue 33) the time of a turn has run out before it begins, so
/// the head jumps to its target.
class HeadPointer : public JointController {
 public:
  /// Pan, then tilt.
  explicit HeadPointer(std::vector<Joint> joints) : JointController(std::move(joints)) {}

  struct Turn {
    std::vector<double> angles;  ///< angles of pan and tilt, beyond their limits if need be
    Nanoseconds min_duration{0};
    double max_velocity = 0;  ///< 0: the joints'; the mean over the turn, its peak is above
  };
  /// Starts from where the head is, from rest to rest. It succeeds when its time is over, wherever
  /// the head is then.
  void start(const Turn& turn, const JointStates& measured, Nanoseconds now);

 private:
  void judge(const JointStates& measured, Nanoseconds now) override;
};

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
