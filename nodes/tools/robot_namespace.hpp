/// \file
/// The robot that this process belongs to, where there are several: ROS's namespace, what the
/// parameter server knows of the robot in one, and a node's ~store.
#pragma once

#include <ros/node_handle.h>

#include <string>

namespace afterglow::nodes {

/// Returns this process's own namespace, "/robot1": as ROS was told at its start, before that
/// $ROS_NAMESPACE; empty: the global one.
std::string rosNamespace();

/// A text of the robot in that namespace, robot_description or tf_prefix: there, else in those
/// around it. Empty: there is none, or no master answers.
std::string robotParameter(const std::string& name_space, const std::string& name);

/// Throws replay::StoreError for a URI with a password, which everybody on the network can read:
/// the parameter is deleted then.
void refuseStorePassword(const ros::NodeHandle& private_node, const std::string& store);

}  // namespace afterglow::nodes
