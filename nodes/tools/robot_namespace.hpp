/// \file
/// The robot that this process belongs to, where there are several: ROS's namespace, and what the
/// parameter server knows of the robot in one.
#pragma once

#include <string>

namespace afterglow::nodes {

/// Returns this process's own namespace, "/robot1": as ROS was told at its start, before that
/// $ROS_NAMESPACE; empty: the global one.
std::string rosNamespace();

/// A text of the robot in that namespace, robot_description or tf_prefix: there, else in those
/// around it. Empty: there is none, or no master answers.
std::string robotParameter(const std::string& name_space, const std::string& name);

}  // namespace afterglow::nodes
