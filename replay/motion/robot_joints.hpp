/// \file
/// The kinds of joints of a robot: by its description (URDF), else by their names. Radians for
/// joints that turn, meters for those that slide.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "replay/plan/robot_profile.hpp"

namespace afterglow::replay {

/// A joint that moves with another one, which it follows by itself: factor * other + offset.
struct MimicJoint {
  std::string other;
  double factor = 1, offset = 0;
};

struct RobotJoint {
  /// Endless: it turns without an end, positions that differ by whole turns are the same.
  enum class Kind { Turning, Sliding, Endless } kind = Kind::Turning;
  std::optional<double> fastest;  ///< rad/s, m/s; empty: not known
  std::optional<MimicJoint> mimic;
  std::optional<JointRange> range = {};  ///< empty: not known, or without an end
};

/// A value. Of a default one no joint is known: those whose names speak of a torso, a gripper or a
/// finger slide, all others turn, and none of them without an end.
class RobotJoints {
 public:
  RobotJoints() = default;
  /// `robot_name`: the description's. `gripper`: a profile's gripper_joints; none: by name.
  RobotJoints(std::string robot_name, std::map<std::string, RobotJoint> joints,
              std::vector<std::string> gripper);

  bool isDescribed() const { return !joints_.empty(); }
  const std::string& robotName() const { return robot_name_; }
  const std::map<std::string, RobotJoint>& all() const { return joints_; }

  bool isSliding(const std::string& joint) const;
  bool isEndless(const std::string& joint) const;
  bool isGripper(const std::string& joint) const;
  /// nullptr: it moves by itself.
  const MimicJoint* mimicOf(const std::string& joint) const;

  /// Returns the difference to add to `then` to come to `now`; for a joint without an end, the
  /// short way round.
  double way(const std::string& joint, double then, double now) const;

 private:
  const RobotJoint* find(const std::string& joint) const;

  std::string robot_name_;
  std::map<std::string, RobotJoint> joints_;
  std::vector<std::string> gripper_;
};

}  // namespace afterglow::replay
