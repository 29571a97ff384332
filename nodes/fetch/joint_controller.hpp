/// \file
/// The common part of Fetch's controllers of joints, simulated: a goal, a command in every cycle, a
/// cancel, and the controller manager's word. Semantics of robot_controllers (melodic-devel) and
/// its faults, which a player has to bear: issue 33, a goal that follows a cancel begins at the
/// last command and its old time. Radians, meters, nanoseconds of robot time.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/fetch/robot_model.hpp"
#include "nodes/fetch/robot_time.hpp"

namespace afterglow::nodes {

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

}  // namespace afterglow::nodes
