/// \file
/// The actions of a graph of ROS 2 on ROS 1.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/ros2/action_to_ros1.hpp"
#include "nodes/ros2/bridge_refusals.hpp"
#include "nodes/ros2/dds.hpp"
#include "nodes/ros2/ros2_types.hpp"

namespace afterglow::nodes {

/// Serves each action while it has a server in ROS 2. One thread calls.
class Ros2Actions {
 public:
  Ros2Actions(DdsParticipant& participant, Ros2Types& types, BridgeRefusals& refusals);

  /// Brings what is served in line with the graph. Returns false if a server is awaited.
  bool look(const std::vector<DdsEndpoint>& all);
  std::size_t count() const { return served_.size(); }
  /// Whether the action had a server when it looked last.
  bool has(const std::string& action) const { return servers_.count(action) > 0; }

 private:
  using Time = std::chrono::steady_clock::time_point;
  struct Served {
    std::unique_ptr<ActionToRos1> action;
    std::optional<Time> end;  ///< its server is gone; until then ROS 1 is told
  };

  bool serve(const std::string& action, const DdsEndpoint& server,
             const std::vector<DdsEndpoint>& all);
  void endUnlessThere();

  DdsParticipant& participant_;
  Ros2Types& types_;
  BridgeRefusals& refusals_;
  std::map<std::string, std::vector<DdsEndpoint>> servers_;  ///< readers of goals by action
  std::map<std::string, Served> served_;
};

}  // namespace afterglow::nodes
