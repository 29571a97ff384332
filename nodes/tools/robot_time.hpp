/// \file
/// The progress of ROS time: with /use_sim_time it is what somebody publishes on /clock.
#pragma once

#include <string>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// Returns the other publisher of /clock, by the master; empty: there is none. Throws
/// std::runtime_error without one.
std::string clockPublisher();

/// Waits for a time other than 0, which every stamp would be. Throws std::runtime_error, one line,
/// if there is none at the deadline, or if /use_sim_time was set after this node had begun.
void requireTime(Deadline deadline);

}  // namespace afterglow::nodes
