/// \file
/// The names of a robot that is one of several: its topics lie in a namespace, its frames begin
/// with a prefix. Also the names of a recorded robot on today's.
#pragma once

#include <functional>
#include <string>

namespace afterglow::replay {

/// Default: a robot alone, whose names are global.
struct RobotNames {
  std::string name_space;    ///< "/robot1"; empty: global
  std::string frame_prefix;  ///< "robot1" of robot1/base_link; empty: none

  /// A topic as profiles and defaults call it, "/odom", as this robot has it: "/robot1/odom". What
  /// all robots share (tf, the map, time, diagnostics) and what lies in the namespace stays.
  std::string topic(const std::string& usual) const;
  /// "base_link" as this robot has it: "robot1/base_link". Frames of the world (map, world, earth)
  /// and those with the prefix stay.
  std::string frame(const std::string& usual) const;

  friend bool operator==(const RobotNames& a, const RobotNames& b) {
    return a.name_space == b.name_space && a.frame_prefix == b.frame_prefix;
  }
  friend bool operator!=(const RobotNames& a, const RobotNames& b) { return !(a == b); }
};

/// A name without its leading slash, as tf2 has frames.
std::string bareName(const std::string& name);

/// "robot1", "/robot1/" and "/robot1" are "/robot1"; "/" is empty.
std::string cleanNamespace(const std::string& text);

/// The robot in that namespace: its prefix is the first that tf knows of `said` (ROS's parameter
/// tf_prefix; may be empty), the namespace's name and that with "_tf" behind it. If tf knows
/// neither these nor the frames without one, it is `said`.
RobotNames findRobotNames(const std::string& name_space, const std::string& said,
                          const std::function<bool(const std::string& frame)>& is_known);

/// The recorded robot's names on today's robot. Names that are not the robot's own stay.
struct RobotRenaming {
  RobotNames recorded, live;

  std::string topic(const std::string& name) const;
  std::string frame(const std::string& name) const;
  bool renamesFrames() const { return recorded.frame_prefix != live.frame_prefix; }
};

/// Returns the renaming to the robot in that namespace. Its prefix is `said`; if that is empty, it
/// is called after the namespace as the recorded one is: "robot1_tf" becomes "robot2_tf".
RobotRenaming renamingTo(const RobotNames& recorded, const std::string& name_space,
                         const std::string& said);

}  // namespace afterglow::replay
