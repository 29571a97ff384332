/// \file
/// The running ROS graph before a replay publishes anything: the layers of projectors, whether a
/// robot is live, other publishers of the replay's topics, and the map.
#pragma once

#include <functional>
#include <string>

#include "nodes/player/replay_request.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/plan/play_plan.hpp"

namespace afterglow::nodes {

/// Tells the request what a plan needs to know of the running graph: its plan's layers, and whether
/// a robot is live under its prefix. Layers are what running projector_nodes subscribe to: asked of
/// the graph, as a parameter or a latched topic would outlive them. Throws as askMaster().
void lookAround(ReplayRequest& request, Deadline deadline);

/// Refuses a live robot where the plan goes by it that no robot is live: throws std::runtime_error,
/// one line that names who, if another node sends joint states or odometry or hears a topic of
/// motion there; and as askMaster().
void refuseLiveRobot(const ReplayRequest& request, Deadline deadline);

/// Throws std::runtime_error, one line that names topic and node, if another living node publishes
/// what is not motion and would be played; and as askMaster(). For what is shown it has to send
/// within a second, as a node that could draw or speak advertises all the time; what a latched
/// topic holds does not count. Motion: RosSink::listenForDrivers().
void refuseLivePublishers(const replay::PlayPlan& plan, const std::function<bool()>& is_stopped);

/// Returns why what was recorded in the map's frame is elsewhere now, a clause; empty: it is not,
/// or it is not known which map it was. Waits for a map that somebody publishes at most 5 s, or
/// until `is_stopped`. Throws as askMaster().
std::string whyOtherMap(const replay::Behavior& behavior, const std::string& topic,
                        const std::function<bool()>& is_stopped);

}  // namespace afterglow::nodes
