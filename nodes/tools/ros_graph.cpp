#include "nodes/tools/ros_graph.hpp"

#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <xmlrpcpp/XmlRpc.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

namespace afterglow::nodes {
namespace {

using XmlRpc::XmlRpcValue;

bool hasPassed(Deadline deadline) { return std::chrono::steady_clock::now() >= deadline; }

/// The payload of a ROS API answer [code, text, payload]; empty if none came in time.
std::optional<XmlRpcValue> call(const std::string& host, int port, const char* method,
                                const XmlRpcValue& parameters, Deadline deadline) {
  XmlRpc::XmlRpcClient client(host.c_str(), port, "/");
  XmlRpcValue answer;
  if (!client.executeNonBlock(method, parameters)) {
    return std::nullopt;
  }
  while (!client.executeCheckDone(answer)) {
    if (hasPassed(deadline)) {
      return std::nullopt;
    }
    client._disp.work(0.02);
  }
  if (client.isFault() || answer.getType() != XmlRpcValue::TypeArray || answer.size() != 3 ||
      answer[0].getType() != XmlRpcValue::TypeInt || static_cast<int>(answer[0]) != 1) {
    return std::nullopt;
  }
  return answer[2];
}

std::optional<XmlRpcValue> callMaster(const char* method, const std::string& argument,
                                      Deadline deadline) {
  XmlRpcValue parameters;
  parameters[0] = ros::this_node::getName();
  if (!argument.empty()) {
    parameters[1] = argument;
  }
  return call(ros::master::getHost(), static_cast<int>(ros::master::getPort()), method, parameters,
              deadline);
}

[[noreturn]] void refuseSilence() {
  throw std::runtime_error("no ROS master answers at " + ros::master::getURI());
}

std::map<std::string, std::set<std::string>> namesByTopic(XmlRpcValue& listing) {
  std::map<std::string, std::set<std::string>> names;
  for (int i = 0; i < listing.size(); ++i) {
    std::set<std::string>& nodes = names[static_cast<std::string>(listing[i][0])];
    for (int n = 0; n < listing[i][1].size(); ++n) {
      nodes.insert(static_cast<std::string>(listing[i][1][n]));
    }
  }
  return names;
}

std::set<std::string> others(const std::map<std::string, std::set<std::string>>& names,
                             const std::string& topic) {
  const auto found = names.find(topic);
  if (found == names.end()) {
    return {};
  }
  std::set<std::string> nodes = found->second;
  nodes.erase(ros::this_node::getName());
  return nodes;
}

/// Topics on which that node sends to this one. A link: [id, destination, direction, transport,
/// topic, ...].
std::set<std::string> topicsSentHere(const std::string& node, Deadline deadline) {
  std::string host;
  std::uint32_t port = 0;
  std::optional<XmlRpcValue> uri = callMaster("lookupNode", node, deadline);
  if (!uri || uri->getType() != XmlRpcValue::TypeString ||
      !ros::network::splitURI(static_cast<std::string>(*uri), host, port)) {
    return {};
  }
  XmlRpcValue parameters;
  parameters[0] = ros::this_node::getName();
  std::optional<XmlRpcValue> links =
      call(host, static_cast<int>(port), "getBusInfo", parameters, deadline);
  std::set<std::string> topics;
  if (!links || links->getType() != XmlRpcValue::TypeArray) {
    return topics;
  }
  for (int i = 0; i < links->size(); ++i) {
    XmlRpcValue& link = (*links)[i];
    if (link.size() >= 5 && static_cast<std::string>(link[1]) == ros::this_node::getName() &&
        static_cast<std::string>(link[2]) == "o") {
      topics.insert(static_cast<std::string>(link[4]));
    }
  }
  return topics;
}

/// What is still missing, by node.
using Missing = std::map<std::string, std::set<std::string>>;

Missing announced(const std::vector<std::string>& topics, Deadline deadline) {
  const RosGraph graph = askMaster(deadline);
  Missing missing;
  for (const std::string& topic : topics) {
    for (const std::string& node : graph.otherPublishers(topic)) {
      missing[node].insert(topic);
    }
  }
  return missing;
}

void strikeOutConnected(Missing& missing, Deadline deadline) {
  for (auto entry = missing.begin(); entry != missing.end();) {
    // One node may take half of what is left, so that a hung one does not hide the others.
    const auto left = deadline - std::chrono::steady_clock::now();
    for (const std::string& topic :
         topicsSentHere(entry->first, std::chrono::steady_clock::now() + left / 2)) {
      entry->second.erase(topic);
    }
    entry = entry->second.empty() ? missing.erase(entry) : std::next(entry);
  }
}

}  // namespace

std::set<std::string> RosGraph::otherPublishers(const std::string& topic) const {
  return others(publishers, topic);
}

std::set<std::string> RosGraph::otherSubscribers(const std::string& topic) const {
  return others(subscribers, topic);
}

std::map<std::string, std::string> askTopicTypes(Deadline deadline) {
  std::optional<XmlRpcValue> listing = callMaster("getTopicTypes", "", deadline);
  if (!listing || listing->getType() != XmlRpcValue::TypeArray) {
    refuseSilence();
  }
  std::map<std::string, std::string> types;
  for (int i = 0; i < listing->size(); ++i) {
    types[static_cast<std::string>((*listing)[i][0])] = static_cast<std::string>((*listing)[i][1]);
  }
  return types;
}

RosGraph askMaster(Deadline deadline) {
  std::optional<XmlRpcValue> state = callMaster("getSystemState", "", deadline);
  if (!state || state->getType() != XmlRpcValue::TypeArray || state->size() != 3) {
    refuseSilence();
  }
  return {namesByTopic((*state)[0]), namesByTopic((*state)[1])};
}

std::vector<std::string> waitForPublishers(const std::vector<std::string>& topics,
                                           Deadline deadline) {
  Missing missing = announced(topics, deadline);
  strikeOutConnected(missing, deadline);
  while (!missing.empty() && !hasPassed(deadline)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    strikeOutConnected(missing, deadline);
  }
  std::vector<std::string> names;
  for (const auto& [node, unheard] : missing) {
    for (const std::string& topic : unheard) {
      names.push_back(node + " on " + topic);
    }
  }
  return names;
}

}  // namespace afterglow::nodes
