/// \file
/// The running ROS graph before a replay publishes anything: the layers of projectors, whether a
/// robot is live, and other publishers of the replay's topics.
#pragma once

#include <functional>
#include <set>
#include <string>

#include "nodes/tools/ros_graph.hpp"
#include "replay/plan/play_plan.hpp"

namespace afterglow::nodes {

/// What running projector_nodes subscribe to: their layers, and /tf. Asked of the graph, as a
/// parameter or a latched topic would outlive them. Throws as askMaster().
std::set<std::string> projectedTopics(Deadline deadline);

/// Throws std::runtime_error, one line that names who, if another node sends joint states or
/// odometry or hears a topic of motion; and as askMaster().
void refuseLiveRobot(Deadline deadline);

/// Throws std::runtime_error, one line that names topic and node, if another living node publishes
/// what is not motion and would be played; and as askMaster(). For what is shown it has to send
/// within a second, as a node that could draw or speak advertises all the time; what a latched
/// topic holds does not count. Motion: RosSink::listenForDrivers().
void refuseLivePublishers(const replay::PlayPlan& plan, const std::function<bool()>& is_stopped);

}  // namespace afterglow::nodes
