#include "nodes/recorder/noted_nodes.hpp"

#include <map>
#include <set>
#include <stdexcept>

#include "nodes/tools/ros_graph.hpp"
#include "replay/plan/recorded_drivers.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kPatience = 1;  // s, for each of two questions

/// "/arm/status" for "/arm/goal": who tells of an action serves it.
std::set<std::string> withStatus(const std::vector<std::string>& topics) {
  const std::string goal = "/goal";
  std::set<std::string> all(topics.begin(), topics.end());
  for (const std::string& topic : topics) {
    if (topic.size() <= goal.size()) continue;
    const std::string action = topic.substr(0, topic.size() - goal.size());
    if (action + goal == topic) all.insert(action + "/status");
  }
  return all;
}

}  // namespace

replay::RecordedNodes nodesNow(const std::vector<std::string>& topics) {
  replay::RecordedNodes nodes;
  try {
    const RosGraph graph = askMaster(deadlineIn(kPatience));
    const std::map<std::string, std::string> types = askTopicTypes(deadlineIn(kPatience));
    std::set<std::string> noted = withStatus(topics);
    for (const auto& [topic, type] : types) {
      if (replay::tellsWhoDrove(type)) noted.insert(topic);
    }
    for (const std::string& topic : noted) {
      const auto type = types.find(topic);
      const replay::TopicNodes around{type == types.end() ? "" : type->second,
                                      graph.otherPublishers(topic), graph.otherSubscribers(topic)};
      if (!around.publishers.empty() || !around.subscribers.empty()) nodes[topic] = around;
    }
  } catch (const std::runtime_error&) {  // a recording goes on without its master
    nodes.clear();
  }
  return nodes;
}

}  // namespace afterglow::nodes
