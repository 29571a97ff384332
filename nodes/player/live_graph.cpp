#include "nodes/player/live_graph.hpp"

#include <nav_msgs/OccupancyGrid.h>

#include <map>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "nodes/player/watchdog.hpp"
#include "nodes/recorder/world_snapshot.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "replay/record/snapshot.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kNodePatience = 0.5;  // s, of one that may be dead
constexpr double kMapPatience = 5;     // s: it may be large
/// Markers that are renewed are so once a second or more often.
constexpr double kListening = 1.1;  // s
constexpr std::uint32_t kEarQueue = 10;

/// The first that lives; empty if none does. Dead nodes stay registered.
std::string anyLiving(const std::set<std::string>& nodes) {
  for (const std::string& node : nodes) {
    if (!isGuard(node) && isAlive(node, deadlineIn(kNodePatience))) return node;
  }
  return "";
}

bool isState(const std::string& type) {
  return type == "sensor_msgs/JointState" || type == "nav_msgs/Odometry";
}

bool isMotion(const std::string& topic, const std::string& type) {
  const replay::TopicClass topic_class = replay::roleOf(topic, type).topic_class;
  return topic_class == replay::TopicClass::Body || topic_class == replay::TopicClass::Endless ||
         type == "geometry_msgs/Twist" || type == "move_base_msgs/MoveBaseActionGoal";
}

[[noreturn]] void refuse(const std::string& topic, const std::string& node) {
  throw std::runtime_error(topic + " is published by " + node + " now: --exclude " + topic +
                           " plays the rest, --remap publishes it under another name");
}

/// Refuses topics that others send on; a latched message does not count.
void refuseSenders(const std::vector<std::string>& topics,
                   const std::function<bool()>& is_stopped) {
  std::mutex mutex;
  std::set<std::pair<std::string, std::string>> held;  // whose latched message has come
  std::map<std::string, std::string> senders;          // node by topic
  CallbackThread thread;
  for (const std::string& topic : topics) {
    thread.hear<AnyMessage>(topic, kEarQueue, [&, topic](const AnyMessage& event) {
      const std::string& sender = event.getPublisherName();
      const ros::M_string& connection = event.getConnectionHeader();
      const auto latching = connection.find("latching");
      const bool is_latching = latching != connection.end() && latching->second == "1";
      const std::lock_guard<std::mutex> lock(mutex);
      const bool is_held = is_latching && held.insert({topic, sender}).second;
      if (!is_held && isAnother(sender)) senders.emplace(topic, sender);
    });
  }
  thread.begin();
  waitForPublishers(topics, deadlineIn(kMasterPatience));
  waitUntil(deadlineIn(kListening), is_stopped, [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return !senders.empty();
  });
  thread.end();
  for (const auto& [topic, node] : senders) refuse(topic, node);
}

/// Returns who makes a robot of it that lives at topics of this namespace, all if it is empty:
/// "NODE sends TOPIC"; empty if there is none.
std::string liveRobot(const RosGraph& graph, const std::string& name_space, Deadline deadline) {
  for (const auto& [topic, type] : askTopicTypes(deadline)) {
    if (topic.rfind(name_space + "/", 0) != 0) continue;
    if (isState(type)) {
      const std::string node = anyLiving(graph.otherPublishers(topic));
      if (!node.empty()) return node + " sends " + topic;
    } else if (isMotion(topic, type)) {
      const std::string node = anyLiving(graph.otherSubscribers(topic));
      if (!node.empty()) return node + " hears " + topic;
    }
  }
  return "";
}

std::set<std::string> projectedTopics(const RosGraph& graph) {
  const std::string service = "/find_surfaces";  // a projector_node's own
  std::set<std::string> projectors, topics;
  for (const auto& [name, nodes] : graph.services) {
    if (!replay::endsWith(name, service)) continue;
    const std::string node = name.substr(0, name.size() - service.size());
    const bool is_there = nodes.count(node) != 0 && isAlive(node, deadlineIn(kNodePatience));
    if (is_there) projectors.insert(node);
  }
  for (const auto& [topic, nodes] : graph.subscribers) {
    for (const std::string& projector : projectors) {
      if (nodes.count(projector) != 0) topics.insert(topic);
    }
  }
  return topics;
}

}  // namespace

void lookAround(ReplayRequest& request, Deadline deadline) {
  const RosGraph graph = askMaster(deadline);
  request.plan.layers = projectedTopics(graph);
  const std::string& prefix = request.plan.prefix;
  request.is_prefix_live = !prefix.empty() && !liveRobot(graph, prefix, deadline).empty();
}

void refuseLiveRobot(const ReplayRequest& request, Deadline deadline) {
  if (request.place() == replay::ReplayPlace::Robot) return;
  const std::string robot =
      liveRobot(askMaster(deadline), request.everything ? "" : request.plan.prefix, deadline);
  if (robot.empty()) return;
  throw std::runtime_error(robot + ": a robot is live, and " +
                           (request.everything ? "--everything" : "all under --prefix") +
                           " is for where none is");
}

void refuseLivePublishers(const replay::PlayPlan& plan, const std::function<bool()>& is_stopped) {
  const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
  std::vector<std::string> perhaps;
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (!topic.isPlayed() || topic.modality == replay::Modality::Body) continue;
    const std::string& name = topic.output.topic;
    const std::string node = anyLiving(graph.otherPublishers(name));
    if (node.empty()) continue;
    if (topic.topic_class != replay::TopicClass::Shown) refuse(name, node);
    perhaps.push_back(name);
  }
  if (!perhaps.empty()) refuseSenders(perhaps, is_stopped);
}

std::string whyOtherMap(const replay::Behavior& behavior, const std::string& topic,
                        const std::function<bool()>& is_stopped) {
  const std::string recorded = replay::recordedMap(behavior);
  if (recorded.empty()) return "";
  std::string now;
  if (!askMaster(deadlineIn(kMasterPatience)).otherPublishers(topic).empty()) {
    ros::CallbackQueue queue;
    ros::NodeHandle node;
    node.setCallbackQueue(&queue);
    const ros::Subscriber subscriber = node.subscribe<nav_msgs::OccupancyGrid>(
        topic, 1,
        [&now](const nav_msgs::OccupancyGridConstPtr& map) { now = mapIdentity(*map); });
    waitUntil(deadlineIn(kMapPatience), is_stopped, [&] {
      queue.callAvailable();
      return !now.empty();
    });
  }
  if (now == recorded || is_stopped()) return "";
  return now.empty() ? "it was recorded on a map, and nobody publishes one on " + topic + " now"
                     : "the map on " + topic + " is not the one it was recorded on";
}

}  // namespace afterglow::nodes
