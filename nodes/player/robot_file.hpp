/// \file
/// Robots' profiles: those of assets/robots, which are built in, and files of the same kind.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nodes/tools/yaml_map.hpp"
#include "replay/messages/robot_names.hpp"
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

}  // namespace afterglow::nodes
