/// \file
/// Robots' profiles: those of assets/robots, which are built in, and files of the same kind. The
/// words and files by which replays are asked for: names for other names, rules, limits.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nodes/tools/yaml_map.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/motion/motion_limits.hpp"
#include "replay/plan/rewrite.hpp"
#include "replay/plan/robot_profile.hpp"

namespace afterglow::nodes {

/// A file, as assets/README.md explains it. Throws std::runtime_error with file and line.
replay::RobotProfile readRobotProfile(const std::string& path);

/// Reads a file's limits of a joint, and of those in its map "joints"; `velocity` is the key of
/// theirs.
replay::JointLimits jointLimits(const YamlMap& map, const std::string& velocity);
std::map<std::string, replay::JointLimits> jointLimitsIn(const YamlMap& map,
                                                         const std::string& velocity,
                                                         std::vector<std::string> other_keys);

/// A file if the text has a slash or ends with ".yaml", else the robot of that name in
/// assets/robots. Throws as readRobotProfile(), and std::runtime_error, one line, for names that
/// are none.
replay::RobotProfile findRobotProfile(const std::string& name_or_file);

/// The profile with its topics and frames as that robot has them.
replay::RobotProfile withNames(replay::RobotProfile robot, const replay::RobotNames& names);

/// The robot of that name in assets/robots; none: there is no such.
std::optional<replay::RobotProfile> builtInRobot(const std::string& name);

/// The profiles that are built in, by file name.
struct EmbeddedRobot {
  const char* name;  ///< "fetch.yaml"; nullptr ends the list
  const char* text;
};
extern const EmbeddedRobot kEmbeddedRobots[];

/// "a:=b". Throws std::invalid_argument, one line.
std::map<std::string, std::string> parseRenames(const std::vector<std::string>& texts);
std::map<replay::TopicName, replay::TopicName> parseTopicRenames(
    const std::vector<std::string>& texts);

struct ReplayRules {
  std::map<std::string, std::map<std::string, replay::RewriteRule>> types;
  std::vector<replay::TopicName> also;
  std::map<replay::TopicName, replay::MotionStop> stops;
};

/// A YAML file of rewriting rules by type and field path, of topics that are published as well, and
/// of how motion is stopped that the player does not know:
///   my_msgs/Plan: {stamp: shift, "steps[].start": now, id: fresh_id, "steps[].frame": remap_frame}
///   also: [/plan]
///   stops: {/wheel/command: zero, /drone/trajectory: empty, /my_drive: {speed: 0},
///           /move_base_simple/goal: {cancel: /move_base/cancel}}
/// with shift, now, zero, keep, fresh_id, remap_frame. Throws std::runtime_error with file and
/// line.
ReplayRules readRules(const std::string& path);

/// A YAML file of limits, where they are lower than the robot's own:
///   linear_velocity: 0.8         # m/s; what is not named is as boundedBy() has it
///   angular_velocity: 2.0        # rad/s
///   joints: {elbow_flex_joint: {velocity: 1.5, acceleration: 2.0}}
///   other_joints: {velocity: 1.0}
/// Throws std::runtime_error with file and line.
replay::MotionLimits readLimits(const std::string& path);

}  // namespace afterglow::nodes
