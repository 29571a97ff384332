/// \file
/// `afterglow init`: the configuration and the launch file of a robot, from what it was heard to
/// say. Pure: text from values.
#pragma once

#include <string>

#include "nodes/verbs/robot_ear.hpp"

namespace afterglow::nodes {

struct SetupWords {
  std::string robot;         ///< name of the robot as --robot gives it, a file absolute
  std::string store;         ///< empty: the default
  std::string calibration;   ///< folder; empty: `calibration` beside the files
};

/// The types of topics that a projector can show.
const std::vector<std::string>& projectableTypes();
/// Topics that could be projected: of these types, published by others than Afterglow's own nodes.
std::vector<std::string> projectableTopics(const RosGraph& graph,
                                           const std::map<std::string, std::string>& types);

/// A projector's configuration that loads (projector_config.hpp): a layer for each topic that was
/// heard in a frame of tf; the others are commented out, and why.
std::string projectorYaml(const replay::RobotProfile& robot, const RunningRobot& running);

/// A launch file that includes ours with this robot's arguments; nothing moves unless its argument
/// allow_motion says so.
std::string robotLaunch(const replay::RobotProfile& robot, const RunningRobot& running,
                        const SetupWords& words);

/// Returns what a person has to check before it is used, one line each.
std::vector<std::string> thingsToCheck(const replay::RobotProfile& robot,
                                       const RunningRobot& running);

}  // namespace afterglow::nodes
