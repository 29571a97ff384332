/// \file
/// How fast a replay may move the body: as was asked for, else by the robot's description and
/// profile (robot_joints.hpp).
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "replay/plan/play_plan.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct MotionLimits {
  struct Joint {
    std::optional<double> velocity, acceleration;  ///< rad or m, per s and s^2; empty: not known
  };
  std::optional<double> linear, angular;  ///< of velocity commands: m/s, rad/s
  std::map<std::string, Joint> joints;
  Joint other_joints;
  /// Hold for what was recorded, too. Else what the robot did once it may do again, and a joint of
  /// unknown speed may go 5 % faster than it did.
  bool is_strict = false;

  /// Of a joint: its own, else those of the other joints.
  const Joint& of(const std::string& joint) const;
};

/// The fastest that a recording does on a topic, at rate 1.
struct MotionPeak {
  std::string topic;
  std::string what;  ///< "linear velocity", "velocity of elbow_flex_joint"
  std::string unit;
  int power = 1;  ///< grows with rate^power
  double value = 0;
  double at_s = 0;  ///< seconds into the behavior
  double limit = 0;
  bool is_limit_known = true;  ///< false: it is as fast as it was, which may be again
};

/// Of the velocities, drives, controllers of joint velocities, trajectories and goals with a
/// velocity of the plan: the velocities of trajectory points, and the mean velocity from one point
/// to the next, or from where the joints were recorded to a single one. Messages that cannot be
/// understood are left out: they are not sent either. Throws StoreError, also if a message of the
/// body is damaged in the store: without it the motion is another one; std::runtime_error, one line
/// with topic, field and time, for a number that is NaN or infinite, in whatever moves the body.
std::vector<MotionPeak> motionPeaks(const Store& store, const PlayPlan& plan,
                                    const MotionLimits& limits);

/// One line that names topic, value, time and limit; empty if the rate breaks none.
std::string whyTooFast(const std::vector<MotionPeak>& peaks, double rate);

}  // namespace afterglow::replay
