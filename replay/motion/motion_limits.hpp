/// \file
/// The one gate for speed: every motion passes it before anything is sent, at every rate and with
/// or without limits that were asked for. A known limit is what was asked for or what the robot's
/// description says, or its profile where that says nothing, whichever is lower. What was recorded
/// may be above a known limit by 5 %, as planners round; where no limit is known, motion may be 5 %
/// faster than it was recorded, and never faster than 3 m/s and 10 rad/s of a base or 10 rad/s
/// (m/s) of a joint. A position may be 0.02 rad or 5 mm beyond its joint's range.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"
#include "replay/motion/robot_joints.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/plan/robot_profile.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// The first number of a message that is infinite or none: "points[2].positions[0] is nan"; empty:
/// there is none.
std::string oddNumber(const Value& document);
/// Throws MessageError for bytes that do not fit.
std::string oddNumber(const Schema& schema, const Bytes& bytes);

struct MotionLimits {
  std::optional<double> linear, angular;  ///< limits of the base: m/s, rad/s
  /// Ramps of the base: m/s^2, rad/s^2. A drive along a track is timed by them; velocities that are
  /// sent as they were recorded are refused at a rate that needs steeper ones.
  std::optional<double> linear_acceleration, angular_acceleration;
  std::map<std::string, JointLimits> joints;
  JointLimits other_joints;
  bool are_given = false;  ///< asked for: what they cannot hold for is not played

  /// Returns the limits of a joint: its own, else those of the other joints.
  const JointLimits& of(const std::string& joint) const;
};

/// Returns the lower of what was asked for and what the robot's description says, or where that
/// says nothing its profile.
MotionLimits boundedBy(MotionLimits asked, const RobotJoints& joints, const RobotProfile& robot);

/// The fastest that a recording does on a topic, at rate 1.
struct MotionPeak {
  std::string topic;
  std::string what;  ///< "linear velocity", "velocity of elbow_flex_joint"
  std::string unit;
  int power = 1;  ///< grows with rate^power
  double value = 0;
  double at_s = 0;  ///< seconds into the behavior
  double limit = 0;    ///< limit of the robot, or where none is known
  double allowed = 0;  ///< the limit, or a little more that was recorded
  std::string remark = {};  ///< the limit's source, if the robot states none
};

/// Reads every message of the plan that moves the body, but for those that cannot be understood,
/// which are not sent either. Peaks are those of velocity topics, steered drives, controllers of
/// joint velocities, goals with a velocity, and trajectories: what a point says of itself, and the
/// mean velocity from one point to the next, to the first one from where the joints were recorded.
/// `is_base_timed`: velocities are not sent as they were, but made for a track.
///
/// Throws StoreError, also if a message of the body is damaged in the store: without it the motion
/// is another one. Throws std::runtime_error, one line with topic, value and time, for a number
/// that is NaN or infinite, a position beyond its joint's range, times of a trajectory that are
/// negative or do not rise, and a first point that is due at once where the joints were not.
std::vector<MotionPeak> motionPeaks(const Store& store, const PlayPlan& plan,
                                    const MotionLimits& limits, const RobotJoints& robot = {},
                                    bool is_base_timed = false);

/// Returns one line that names topic, value, time and limit; empty if the rate breaks none.
std::string whyTooFast(const std::vector<MotionPeak>& peaks, double rate);

}  // namespace afterglow::replay
