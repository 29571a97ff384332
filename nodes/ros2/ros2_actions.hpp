/// \file
/// The actions of a graph of ROS 2 on ROS 1, and the other way round.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/ros2/action_to_ros1.hpp"
#include "nodes/ros2/action_to_ros2.hpp"
#include "nodes/ros2/bridge_refusals.hpp"
#include "nodes/ros2/dds.hpp"
#include "nodes/ros2/ros2_types.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// Serves each action of ROS 2 on ROS 1 while it has a server there, and one of ROS 1 on ROS 2
/// while it has a client there. One thread calls.
class Ros2Actions {
 public:
  Ros2Actions(DdsParticipant& participant, Ros2Types& types, BridgeRefusals& refusals);

  /// What ROS 1's master tells: nodes, and types of topics.
  struct Ros1 {
    const RosGraph& graph;
    const std::map<std::string, std::string>& types;
  };
  /// Brings what is served in line with both graphs. Returns false if a server is awaited.
  bool look(const std::vector<DdsEndpoint>& all, const Ros1& ros1);
  std::size_t count() const { return to_ros1_.size() + to_ros2_.size(); }
  /// Whether the action had a server when it looked last.
  bool has(const std::string& action) const {
    return servers_.count(action) > 0 || wanted_.count(action) > 0;
  }

 private:
  using Time = std::chrono::steady_clock::time_point;
  using Endpoints = std::map<std::string, std::vector<DdsEndpoint>>;
  template <typename Action>
  struct Served {
    std::unique_ptr<Action> action;
    Time begin;               ///< of the wait for its server
    std::optional<Time> end;  ///< its server is gone; until then its clients are told
  };

  void sort(const std::vector<DdsEndpoint>& all, const Ros1& ros1);
  template <typename Action, typename IsThere>
  static void endUnless(std::map<std::string, Served<Action>>& served, const IsThere& is_there);
  bool serveOnRos1(const std::string& action, const DdsEndpoint& server,
                   const std::vector<DdsEndpoint>& all);
  bool serveOnRos2(const std::string& action, const DdsEndpoint& client,
                   const std::vector<DdsEndpoint>& all, const Ros1& ros1);
  struct Found;
  std::optional<Found> find(const std::string& action, const DdsEndpoint& goals,
                            const std::vector<DdsEndpoint>& all);

  DdsParticipant& participant_;
  Ros2Types& types_;
  BridgeRefusals& refusals_;
  Endpoints servers_;  ///< readers of goals by action
  Endpoints wanted_;   ///< writers of goals by action whose server is in ROS 1
  std::map<std::string, Served<ActionToRos1>> to_ros1_;
  std::map<std::string, Served<ActionToRos2>> to_ros2_;
};

}  // namespace afterglow::nodes
