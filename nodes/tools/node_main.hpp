/// \file
/// The common part of all nodes' main().
#pragma once

#include <ros/ros.h>

#include <functional>
#include <string>
#include <vector>

namespace afterglow::nodes {

struct NodeText {
  std::string name;           ///< "player_node"
  std::string does;           ///< "replays stored behaviors: by action and by service."
  std::string launch;         ///< the launch file that explains its parameters; empty: none
  std::string ros_name = {};  ///< node's name but for `__name:=`; empty: `name`
};

/// The work of a node, which returns when a stop is requested (stop_signal.hpp). `own` is the
/// handle of its parameters: with the last handle ROS shuts down, its log first. `arguments` are
/// those of the command line that are not ROS's.
using NodeWork =
    std::function<void(const ros::NodeHandle& own, const std::vector<std::string>& arguments)>;

/// Answers --help; else catches signals and shutdown requests, waits for a master, begins ROS and
/// calls `work`. Returns the exit status: 0, 1 with one line on stderr for an exception, 2 likewise
/// for std::invalid_argument, which arguments cause.
int runNode(int argc, char** argv, const NodeText& text, const NodeWork& work);

}  // namespace afterglow::nodes
