/// \file
/// The controllers that run, by ros_control's controller managers: a stopped one rejects every
/// goal, and does not hear its commands.
#pragma once

#include <map>
#include <string>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// "running", "stopped", "initialized" ... by a controller's full name: "/arm_controller".
using ControllerStates = std::map<std::string, std::string>;

/// Asks every controller manager of the graph that lives; empty on a robot without any.
ControllerStates askControllers(const RosGraph& graph);

/// Returns why nobody obeys what is sent on a topic or to an action: "arm_controller is stopped
/// (controller_manager): start it with ..."; empty if its controller runs, or is none of these.
std::string whyNotRunning(const ControllerStates& states, const std::string& topic);

}  // namespace afterglow::nodes
