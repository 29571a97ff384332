/// \file
/// Where the joint trajectories of a replay begin: where the robot's joints are, not where they
/// were, or where a controller takes them to be. Fetch's trajectory controllers go on from the last
/// sample of a canceled goal, with its old time (robot_controllers issue 33), and jump by as much
/// as the arm, or time, has moved since; a trajectory whose first point is the measured position,
/// due at once, is followed from there. Radians, meters, seconds.
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
#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/joint_track.hpp"
#include "replay/motion/motion_limits.hpp"
#include "replay/motion/start_pose.hpp"

namespace afterglow::replay {

/// A joint is not where its goal may begin, or its position is unknown: the goal must not be sent.
/// One line.
struct ArmElsewhere : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct LiveJoint {
  double position = 0, velocity = 0;
};

struct ArmStartOptions {
  /// What happens to a goal whose joints are elsewhere. Refuse: it is not sent. Approach: the
  /// joints first go to where it begins, at `speed`. Accept: they go on from where they are, in the
  /// time that was recorded.
  enum class Elsewhere { Refuse, Approach, Accept } elsewhere = Elsewhere::Refuse;
  StartTolerances tolerances;
  ApproachSpeed speed;
  MotionLimits limits;
  RobotJoints robot;
};

/// For one replay; one thread.
class ArmStart {
 public:
  /// Empty if no recent joint state has this joint.
  using Look = std::function<std::optional<LiveJoint>(const std::string& joint)>;

  ArmStart(JointTrack recorded, Look look, const ArmStartOptions& options)
      : recorded_(std::move(recorded)), look_(std::move(look)), options_(options) {}

  /// How long the joints need to get to where this goal, or the rest of a goal, begins; 0 if they
  /// are there; empty for a goal without a trajectory. The goal has the times it will be sent with.
  /// Live joints are compared with the recorded joint states at `at`, the recorded moment that the
  /// goal is sent for, give or take a quarter of a second, or with the positions they were halted
  /// at. Where neither is known, they are compared with the goal's first point if that is due at
  /// once; to a first point that is due later, the joints may not have to move faster than the goal
  /// itself, their limits or the approach. Throws ArmElsewhere; MessageError for bytes that are no
  /// goal.
  std::optional<double> leadOf(const Channel& channel, const Bytes& goal, Stamp at) const;

  /// The goal with the live state of its joints as first point, due at once. With a lead its points
  /// come so much later, and the position it goes on from becomes a point of its own, at rest.
  /// Deviations below the tolerances are corrected along the way, at the approach's speed. Goals
  /// without a trajectory are returned as they are. Throws as leadOf().
  Bytes begin(const Channel& channel, const Bytes& goal, Stamp at, double lead_s) const;

  /// The joints were halted and stand now: goals may go on from these positions, too.
  void halted();
  /// The replay goes on at another recorded moment.
  void forgetHalted() { halted_.clear(); }

 private:
  struct Beginning;
  Beginning beginningOf(const Trajectory& trajectory, Stamp at) const;
  double wayOf(const std::string& joint, double from, double to) const;
  double deviationOf(const std::string& joint, const JointTrack::Reach& reach, double now) const;
  double leadOf(const std::string& joint, double then, double deviation, double now) const;
  void beginAlong(const std::vector<std::string>& joints, const Beginning& now,
                  Array& points) const;
  void checkSpeed(const Trajectory& trajectory, std::size_t joint, double now, double& lead) const;
  double speedOf(const std::string& joint) const;

  JointTrack recorded_;
  const Look look_;
  const ArmStartOptions options_;
  mutable std::set<std::string> moved_;  ///< joints of goals that were begun
  std::map<std::string, double> halted_;
};

}  // namespace afterglow::replay
