#include "nodes/tools/registration.hpp"

#include <ros/connection_manager.h>
#include <ros/console.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/publication.h>
#include <ros/this_node.h>
#include <ros/topic_manager.h>
#include <ros/xmlrpc_manager.h>
#include <xmlrpcpp/XmlRpc.h>

#include <chrono>
#include <exception>
#include <utility>
#include <vector>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

using XmlRpc::XmlRpcValue;

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

}  // namespace afterglow::nodes
