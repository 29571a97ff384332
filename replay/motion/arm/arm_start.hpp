/// \file
/// The begin of a replay's joint trajectories: where the robot's joints are, not where they were,
/// or where a controller takes them to be. Fetch's trajectory controllers go on from the last
/// sample of a canceled goal, with its old time (robot_controllers issue 33), and jump by as much
/// as the arm, or time, has moved since; a trajectory whose first point is the measured position,
/// due at once, is followed from there. Controllers that join a goal to where they have the joints
/// themselves (ros_controllers, pr2_controllers) get no such point: joints in motion are no longer
/// where they were heard to be, and a PR2 would step back there. Radians, meters, seconds.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/message.hpp"
#include "replay/motion/arm/approach.hpp"
#include "replay/motion/arm/arm_path.hpp"
#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/joint_track.hpp"

namespace afterglow::replay {

/// A joint is not where its goal may begin, or its position is unknown: the goal must not be sent.
/// One line.
struct ArmElsewhere : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct LiveJoint {
  double position = 0, velocity = 0;
};

struct ArmStartOptions : Approach::Rules {
  /// The treatment of a goal whose joints are elsewhere. Refuse: it is not sent. Approach: the
  /// joints first go to where it begins, at `speed`. Accept: they go on from where they are, in the
  /// time that was recorded.
  enum class Elsewhere { Refuse, Approach, Accept } elsewhere = Elsewhere::Refuse;
  /// Finds the way of joints that are elsewhere; outlives this. nullptr: any way, straight.
  const Approach* approach = nullptr;
  bool controllers_join = false;  ///< RobotProfile::controllers_join
};

/// A moment of a goal that is to go on.
struct GoalProgress {
  Stamp begun;           ///< the recorded moment that the goal was sent at
  Stamp at;              ///< the recorded moment that it goes on at
  double elapsed_s = 0;  ///< time between them in the goal's own time, at rate 1
};

/// The needs of the rest of a goal before recorded time goes on.
struct RestNeed {
  double seconds = 0;
  bool is_elsewhere = false;  ///< the joints are off the goal's path and have to go there first
};

/// Serves one replay, in one thread.
class ArmStart {
 public:
  /// Empty if no recent joint state has this joint.
  using Look = std::function<std::optional<LiveJoint>(const std::string& joint)>;

  ArmStart(JointTrack recorded, Look look, const ArmStartOptions& options)
      : recorded_(std::move(recorded)), look_(std::move(look)), options_(options) {}

  bool controllersJoin() const { return options_.controllers_join; }

  /// Returns how long the joints need to get to where this goal, or the rest of a goal, begins; 0
  /// if they are there; empty for a goal without a trajectory. The goal has the times it will be
  /// sent with. Live joints are compared with the recorded joint states at `at`, the recorded
  /// moment that the goal is sent for, give or take a quarter of a second, or with the positions
  /// they were halted at. Where neither is known, they are compared with the goal's first point if
  /// that is due at once; to a first point that is due later, the joints may not have to move
  /// faster than the goal itself, their limits or the approach. Throws ArmElsewhere; MessageError
  /// for bytes that are no goal.
  std::optional<double> leadOf(const Channel& channel, const Bytes& goal, Stamp at) const;

  /// The goal with the live state of its joints as first point, due at once; without any such point
  /// if the controllers join. With a lead its points come so much later, and the position it goes
  /// on from becomes a point of its own, at rest. Deviations below the tolerances are corrected
  /// along the way, at the approach's speed. A single point that the joints would have to reach
  /// faster than they may, or did, is refused. Goals without a trajectory are returned as they are.
  /// Throws as leadOf().
  Bytes begin(const Channel& channel, const Bytes& goal, Stamp at, double lead_s) const;

  /// Returns what the joints need to go on within this goal: to set off from rest and, if they are
  /// behind, to make good the delay; if they are off its path, to get there. The goal has the times
  /// it would have been sent with as a whole. Empty and throws as leadOf().
  std::optional<RestNeed> needToGoOn(const Channel& channel, const Bytes& goal,
                                     const GoalProgress& progress) const;
  /// The rest of the goal, from the place on its path where the joints are: they set off from rest,
  /// or at the speed they have, and follow the path forward, never faster than it was, until they
  /// are as fast as the path. Joints that are off it by less than the tolerances get onto it on the
  /// way; others first go to where the path is at that moment, in `lead_s` at least, and stand.
  /// Before a first point that is due later the path begins where the joint states were recorded;
  /// without those, and for joints that nobody tells of, the rest is begun as a goal of its own.
  /// Throws as leadOf().
  Bytes goOn(const Channel& channel, const Bytes& goal, const GoalProgress& progress,
             double lead_s) const;

  /// The mean velocity that a head's goal, sent at `begun` and going on at `at`, may have; rad/s.
  /// Its joints are those that "head" is in the name of, as the goal tells none. At its peak that
  /// is no faster than they were recorded within it, or than the approach.
  double headVelocity(Stamp begun, Stamp at) const;

  /// The joints were halted and stand now: goals may go on from these positions, too.
  void halted();
  /// The replay goes on at another recorded moment.
  void forgetHalted() { halted_.clear(); }

 private:
  struct Beginning;
  struct Rest;
  std::optional<LiveJoint> liveOf(const std::string& joint) const;
  std::optional<ArmPath> pathOf(const Trajectory& trajectory, const GoalProgress& progress) const;
  std::optional<Rest> restOf(const Trajectory& trajectory, const GoalProgress& progress) const;
  void findPlace(const std::vector<std::string>& joints, const std::vector<LiveJoint>& live,
                 double elapsed_s, Rest& rest) const;
  double rampOf(const std::vector<std::string>& joints, const Rest& rest) const;
  Beginning beginningOf(const Trajectory& trajectory, Stamp at) const;
  double wayOf(const std::string& joint, double from, double to) const;
  double leadOf(const std::string& joint, double then, double deviation, double now) const;
  JointWay wayTo(const std::vector<std::string>& joints, const std::vector<double>& from,
                 const std::vector<double>& to, Stamp at) const;
  double offsetOf(const Beginning& now, std::size_t joint, const std::string& name) const;
  void beginAlong(const std::vector<std::string>& joints, const Beginning& now,
                  Array& points) const;
  void checkSpeed(const Trajectory& trajectory, std::size_t joint, double now, double& lead) const;
  void checkOnlyPoint(const Trajectory& trajectory, const Beginning& now, Stamp at) const;
  double speedOf(const std::string& joint) const;

  JointTrack recorded_;
  const Look look_;
  const ArmStartOptions options_;
  mutable std::set<std::string> moved_;  ///< joints of goals that were begun
  std::map<std::string, double> halted_;
};

}  // namespace afterglow::replay
