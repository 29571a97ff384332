/// \file
/// The way of velocities to a base, as the running ROS graph shows it: through a multiplexer, by
/// which a person may take over.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// A node that hears velocities on one topic and sends them on another.
struct VelocityRoute {
  std::string node;
  std::string output;               ///< empty: not advertised yet, as topic_tools' mux does late
  std::vector<std::string> inputs;  ///< others'
  std::string selected;             ///< std_msgs/String, the input that it passes on; or empty
};

/// The nodes that pass on what is sent on `topic`: those that hear it and publish one velocity
/// topic alone, or say which input they have selected, as topic_tools' mux does.
std::vector<VelocityRoute> velocityRoutes(const RosGraph& graph,
                                          const std::map<std::string, std::string>& types,
                                          const std::string& topic);

}  // namespace afterglow::nodes
