#include "nodes/player/velocity_route.hpp"

#include <set>

#include "replay/messages/topic_name.hpp"
#include "replay/plan/recorded_drivers.hpp"

namespace afterglow::nodes {
namespace {

using NodesByTopic = std::map<std::string, std::set<std::string>>;
using Types = std::map<std::string, std::string>;

std::string typeOf(const Types& types, const std::string& topic) {
  const auto found = types.find(topic);
  return found == types.end() ? "" : found->second;
}

/// Returns a node's velocities among these topics, but for one.
std::vector<std::string> velocitiesOf(const std::string& node, const NodesByTopic& topics,
                                      const Types& types, const std::string& but) {
  std::vector<std::string> names;
  for (const auto& [topic, nodes] : topics) {
    const bool is_its = topic != but && nodes.count(node) > 0;
    if (is_its && replay::isTwist(typeOf(types, topic))) names.push_back(topic);
  }
  return names;
}

std::string selectedOf(const std::string& node, const RosGraph& graph, const Types& types) {
  for (const auto& [topic, nodes] : graph.publishers) {
    const bool is_its = replay::endsWith(topic, "/selected") && nodes.count(node) > 0;
    if (is_its && typeOf(types, topic) == "std_msgs/String") return topic;
  }
  return "";
}

}  // namespace

std::vector<VelocityRoute> velocityRoutes(const RosGraph& graph, const Types& types,
                                          const std::string& topic) {
  std::vector<VelocityRoute> routes;
  for (const std::string& node : graph.otherSubscribers(topic)) {
    const std::vector<std::string> outputs =
        velocitiesOf(node, graph.publishers, types, topic);
    VelocityRoute route{node, outputs.size() == 1 ? outputs.front() : "", {},
                        selectedOf(node, graph, types)};
    if (route.output.empty() && route.selected.empty()) continue;
    for (const std::string& input : velocitiesOf(node, graph.subscribers, types, topic)) {
      // Its own output, in a simulator that is multiplexer and base in one.
      if (input != route.output) route.inputs.push_back(input);
    }
    routes.push_back(route);
  }
  return routes;
}

}  // namespace afterglow::nodes
