#include "nodes/tools/ros_graph.hpp"

#include <ros/connection_manager.h>
#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/param.h>
#include <ros/publication.h>
#include <ros/ros.h>
#include <ros/this_node.h>
#include <ros/topic_manager.h>
#include <ros/xmlrpc_manager.h>
#include <xmlrpcpp/XmlRpc.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "nodes/tools/stop_signal.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {
namespace {

using XmlRpc::XmlRpcValue;

bool hasPassed(Deadline deadline) { return std::chrono::steady_clock::now() >= deadline; }

/// The payload of a ROS API answer [code, text, payload]; empty if none came in time.
std::optional<XmlRpcValue> call(XmlRpc::XmlRpcClient& client, const char* method,
                                const XmlRpcValue& parameters, Deadline deadline) {
  XmlRpcValue answer;
  if (!client.executeNonBlock(method, parameters)) {
    return std::nullopt;
  }
  while (!client.executeCheckDone(answer)) {
    if (hasPassed(deadline)) {
      client.close();  // a late answer is none to the next question
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

std::optional<XmlRpcValue> call(const std::string& host, std::uint32_t port, const char* method,
                                const XmlRpcValue& parameters, Deadline deadline) {
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  return call(client, method, parameters, deadline);
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

/// Adds what that node sends to this one. A link: [id, destination, direction, transport, topic,
/// ...].
void addLinksOf(const std::string& node, Deadline deadline, Links& links) {
  const auto address = addressOf(node, deadline);
  if (!address) {
    return;
  }
  XmlRpcValue parameters;
  parameters[0] = ros::this_node::getName();
  std::optional<XmlRpcValue> info =
      call(address->host, address->port, "getBusInfo", parameters, deadline);
  if (!info || info->getType() != XmlRpcValue::TypeArray) {
    return;
  }
  for (int i = 0; i < info->size(); ++i) {
    XmlRpcValue& link = (*info)[i];
    if (link.size() >= 5 && static_cast<std::string>(link[1]) == ros::this_node::getName() &&
        static_cast<std::string>(link[2]) == "o") {
      links[{node, static_cast<std::string>(link[4])}].insert(link[0].toXml());
    }
  }
}

/// Gives one node half of what is left, so that a hung one does not hide the others.
Deadline halfWay(Deadline deadline) {
  const auto now = std::chrono::steady_clock::now();
  return now + (deadline - now) / 2;
}

/// The missing ones, by node.
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

bool hasNew(const std::set<std::string>& ids, const std::set<std::string>& old) {
  return !std::includes(old.begin(), old.end(), ids.begin(), ids.end());
}

void strikeOutConnected(Missing& missing, Deadline deadline, const Links& old) {
  for (auto entry = missing.begin(); entry != missing.end();) {
    Links links;
    addLinksOf(entry->first, halfWay(deadline), links);
    for (const auto& [node_and_topic, ids] : links) {
      const auto before = old.find(node_and_topic);
      if (before == old.end() || hasNew(ids, before->second)) {
        entry->second.erase(node_and_topic.second);
      }
    }
    entry = entry->second.empty() ? missing.erase(entry) : std::next(entry);
  }
}

std::string masterUri(int argc, char** argv) {
  const std::string remapping = "__master:=";
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.rfind(remapping, 0) == 0) return argument.substr(remapping.size());
  }
  const char* uri = std::getenv("ROS_MASTER_URI");
  if (uri == nullptr || *uri == '\0') throw std::runtime_error("ROS_MASTER_URI is not set");
  return uri;
}

}  // namespace

std::set<std::string> RosGraph::otherPublishers(const std::string& topic) const {
  return others(publishers, topic);
}

std::set<std::string> RosGraph::otherSubscribers(const std::string& topic) const {
  return others(subscribers, topic);
}

struct MasterLink::State {
  std::optional<XmlRpcValue> call(const char* method, const std::string& argument,
                                  Deadline deadline) {
    XmlRpcValue parameters;
    parameters[0] = ros::this_node::getName();
    if (!argument.empty()) parameters[1] = argument;
    return nodes::call(client, method, parameters, deadline);
  }

  XmlRpc::XmlRpcClient client{ros::master::getHost().c_str(),
                              static_cast<int>(ros::master::getPort()), "/"};
};

MasterLink::MasterLink() : state_(std::make_unique<State>()) {}
MasterLink::~MasterLink() = default;

bool MasterLink::isThere(Deadline deadline) {
  return state_->call("getPid", "", deadline).has_value();
}

std::map<std::string, std::string> MasterLink::topicTypes(Deadline deadline) {
  std::optional<XmlRpcValue> listing = state_->call("getTopicTypes", "", deadline);
  if (!listing || listing->getType() != XmlRpcValue::TypeArray) {
    refuseSilence();
  }
  std::map<std::string, std::string> types;
  for (int i = 0; i < listing->size(); ++i) {
    types[static_cast<std::string>((*listing)[i][0])] = static_cast<std::string>((*listing)[i][1]);
  }
  return types;
}

RosGraph MasterLink::graph(Deadline deadline) {
  std::optional<XmlRpcValue> state = state_->call("getSystemState", "", deadline);
  if (!state || state->getType() != XmlRpcValue::TypeArray || state->size() != 3) {
    refuseSilence();
  }
  return {namesByTopic((*state)[0]), namesByTopic((*state)[1]), namesByTopic((*state)[2])};
}

std::optional<NodeAddress> MasterLink::addressOf(const std::string& node, Deadline deadline) {
  NodeAddress address;
  std::optional<XmlRpcValue> uri = state_->call("lookupNode", node, deadline);
  const bool is_known =
      uri && uri->getType() == XmlRpcValue::TypeString &&
      ros::network::splitURI(static_cast<std::string>(*uri), address.host, address.port);
  return is_known ? std::optional(address) : std::nullopt;
}

RosGraph askMaster(Deadline deadline) { return MasterLink().graph(deadline); }

std::map<std::string, std::string> askTopicTypes(Deadline deadline) {
  return MasterLink().topicTypes(deadline);
}

std::optional<NodeAddress> addressOf(const std::string& node, Deadline deadline) {
  return MasterLink().addressOf(node, deadline);
}

bool isAlive(const std::string& node, Deadline deadline) {
  const auto address = addressOf(node, deadline);
  return address && isAlive(*address, deadline);
}

bool isAlive(const NodeAddress& address, Deadline deadline) {
  XmlRpcValue parameters;
  parameters[0] = ros::this_node::getName();
  return call(address.host, address.port, "getPid", parameters, deadline).has_value();
}

Links linksHere(const std::vector<std::string>& topics, Deadline deadline) {
  Links links;
  for (const auto& [node, unheard] : announced(topics, deadline)) {
    addLinksOf(node, halfWay(deadline), links);
  }
  for (auto link = links.begin(); link != links.end();) {
    const bool is_asked =
        std::find(topics.begin(), topics.end(), link->first.second) != topics.end();
    link = is_asked ? std::next(link) : links.erase(link);
  }
  return links;
}

std::vector<std::string> waitForPublishers(const std::vector<std::string>& topics,
                                           Deadline deadline, const Links& old) {
  Missing missing = announced(topics, deadline);
  strikeOutConnected(missing, deadline, old);
  while (!missing.empty() && !hasPassed(deadline)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    strikeOutConnected(missing, deadline, old);
  }
  std::vector<std::string> names;
  for (const auto& [node, unheard] : missing) {
    for (const std::string& topic : unheard) {
      names.push_back(node + " on " + topic);
    }
  }
  return names;
}

bool awaitMaster(int argc, char** argv, const std::string& node) {
  const std::string uri = masterUri(argc, argv);
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(uri, host, port)) {
    throw std::runtime_error("'" + uri + "' is no ROS master's URI");
  }
  XmlRpcValue arguments;
  arguments[0] = "/afterglow";
  for (bool is_told = false; !isStopRequested(); is_told = true) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    if (call(host, port, "getPid", arguments, deadline)) return true;
    if (!is_told) std::cerr << node << ": waiting for a ROS master at " << uri << std::endl;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  return false;
}

void boundWaitsForMaster() { ros::master::setRetryTimeout(ros::WallDuration(1)); }

namespace {

constexpr std::chrono::seconds kPeriod(1);
constexpr double kMasterAnswers = 1.0;  // s
const char kLog[] = "/rosout";          // every node publishes it

XmlRpcValue listOf(const std::vector<std::string>& texts) {
  XmlRpcValue list;
  list.setSize(static_cast<int>(texts.size()));
  for (std::size_t i = 0; i < texts.size(); ++i) list[static_cast<int>(i)] = texts[i];
  return list;
}

std::string ownUri() { return ros::XMLRPCManager::instance()->getServerURI(); }

bool tellMaster(const char* method, const std::vector<std::string>& arguments,
                XmlRpcValue& payload) {
  std::vector<std::string> all = {ros::this_node::getName()};
  all.insert(all.end(), arguments.begin(), arguments.end());
  XmlRpcValue answer;
  return ros::master::execute(method, listOf(all), answer, payload, false);
}

/// Takes the publishers that the master answered to a subscriber; later changes it tells by a call:
/// we call ourselves.
void takePublishers(const std::string& topic, const XmlRpcValue& publishers) {
  std::string host;
  std::uint32_t port = 0;
  if (publishers.size() == 0 || !ros::network::splitURI(ownUri(), host, port)) return;
  XmlRpcValue parameters, answer;
  parameters[0] = "/master";
  parameters[1] = topic;
  parameters[2] = publishers;
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  client.execute("publisherUpdate", parameters, answer);
}

bool registerPublisher(const std::string& topic) {
  const auto publication = ros::TopicManager::instance()->lookupPublication(topic);
  XmlRpcValue payload;
  return !publication ||  // it has ended meanwhile
         tellMaster("registerPublisher", {topic, publication->getDataType(), ownUri()}, payload);
}

bool registerPublishers() {
  ros::V_string topics;
  ros::this_node::getAdvertisedTopics(topics);
  bool is_done = true;
  for (const std::string& topic : topics) {
    if (topic != kLog) is_done &= registerPublisher(topic);
  }
  return is_done;
}

bool registerSubscribers() {
  ros::V_string topics;
  ros::this_node::getSubscribedTopics(topics);
  bool is_done = true;
  for (const std::string& topic : topics) {
    XmlRpcValue publishers;
    is_done &= tellMaster("registerSubscriber", {topic, "*", ownUri()}, publishers);
    if (publishers.getType() == XmlRpcValue::TypeArray) takePublishers(topic, publishers);
  }
  return is_done;
}

bool registerServices(const std::set<std::string>& services) {
  const std::string address = "rosrpc://" + ros::network::getHost() + ":" +
                              std::to_string(ros::ConnectionManager::instance()->getTCPPort());
  bool is_done = true;
  for (const std::string& service : services) {
    XmlRpcValue payload;
    is_done &= tellMaster("registerService", {service, address, ownUri()}, payload);
  }
  return is_done;
}

}  // namespace

Registration::Registration() : thread_(kPeriod, [this] { look(); }) { thread_.begin(); }

void Registration::look() try {
  const std::string& name = ros::this_node::getName();
  RosGraph graph = askMaster(deadlineIn(kMasterAnswers));
  if (graph.publishers[kLog].count(name) > 0) {
    was_known_ = true;
    std::set<std::string> own;
    for (const auto& [service, nodes] : graph.services) {
      if (nodes.count(name) > 0) own.insert(service);
    }
    services_ = std::move(own);
  } else if (was_known_ && registerAgain()) {
    ROS_WARN("the ROS master has been started anew and did not know this node: it is told again");
  }
} catch (const std::exception& error) {  // no master, or none that answers
  ROS_DEBUG("%s", error.what());
}

/// The log last: a master that knows it has been told all.
bool Registration::registerAgain() const {
  return registerServices(services_) && registerSubscribers() && registerPublishers() &&
         registerPublisher(kLog);
}

std::string clockPublisher() {
  const auto others = askMaster(deadlineIn(kMasterPatience)).otherPublishers("/clock");
  return others.empty() ? "" : *others.begin();
}

void requireTime(Deadline deadline) {
  // roscpp looks only when a node begins.
  bool is_set = false;
  ros::param::get("/use_sim_time", is_set);
  if (is_set && !ros::Time::isSimTime()) {
    throw std::runtime_error(
        "/use_sim_time was set after this node had begun: its time is not the robot's; start it "
        "anew");
  }
  if (!ros::Time::isSimTime()) return;
  const std::string publisher = clockPublisher();
  if (publisher.empty()) {
    throw std::runtime_error(
        "/use_sim_time is set and nobody publishes /clock: the robot's time stands still");
  }
  while (ros::Time::now().isZero()) {
    if (std::chrono::steady_clock::now() >= deadline) {
      throw std::runtime_error("/use_sim_time is set and the /clock of " + publisher +
                               " says 0: the robot's time has not begun");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

std::string rosNamespace() {
  if (ros::isInitialized()) return replay::cleanNamespace(ros::this_node::getNamespace());
  const char* name_space = std::getenv("ROS_NAMESPACE");
  return replay::cleanNamespace(name_space ? name_space : "");
}

std::string robotParameter(const std::string& name_space, const std::string& name) {
  std::string text, scope = name_space;
  while (!ros::param::get(scope + "/" + name, text) && !scope.empty()) {
    scope.resize(scope.rfind('/'));
  }
  return text;
}

void refuseStorePassword(const ros::NodeHandle& private_node, const std::string& store) {
  try {
    replay::refusePassword("~store", store);
  } catch (const replay::StoreError&) {
    private_node.deleteParam("store");
    throw;
  }
}

}  // namespace afterglow::nodes
