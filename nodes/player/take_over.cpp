#include "nodes/player/take_over.hpp"

#include <std_msgs/String.h>

#include <chrono>
#include <cstdint>
#include <exception>
#include <set>
#include <thread>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/player/base_sensors.hpp"
#include "nodes/player/watchdog.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/plan/permission.hpp"
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
    const std::vector<std::string> outputs = velocitiesOf(node, graph.publishers, types, topic);
    VelocityRoute route{
        node, outputs.size() == 1 ? outputs.front() : "", {}, selectedOf(node, graph, types)};
    if (route.output.empty() && route.selected.empty()) continue;
    for (const std::string& input : velocitiesOf(node, graph.subscribers, types, topic)) {
      // Its own output, in a simulator that is multiplexer and base in one.
      if (input != route.output) route.inputs.push_back(input);
    }
    routes.push_back(route);
  }
  return routes;
}

namespace {

constexpr std::uint32_t kListenQueue = 50;
constexpr double kScouting = 1.0;    // s; a multiplexer advertises what it puts out late
constexpr double kConnecting = 0.5;  // s
constexpr std::chrono::milliseconds kFirstNews(100);
constexpr const char* kOdometryType = "nav_msgs/Odometry";

replay::ObedienceOptions obedienceOf(const replay::RobotProfile::Base& base) {
  replay::ObedienceOptions options;
  // Half of what it can do: a heavy load, a soft floor.
  if (base.deceleration > 0) options.deceleration = base.deceleration / 2;
  return options;
}

}  // namespace

TakeOver::TakeOver(std::string base_topic, const replay::RobotProfile::Base& base,
                   replay::MessageSink& sink)
    : topic_(std::move(base_topic)),
      base_(base),
      sink_(sink),
      watch_(topic_, {base.take_over_topics.begin(), base.take_over_topics.end()}),
      obedience_(obedienceOf(base)) {}

void TakeOver::begin(std::function<void(const std::string&)> on_taken) {
  on_taken_ = std::move(on_taken);
  for (const std::string& topic : base_.take_over_topics) listenToInput(topic);
  scout();
  thread_.every(kScouting, [this] { scout(); });
  const std::vector<std::string> topics(heard_.begin(), heard_.end());
  thread_.begin();
  // What is latched comes with the connection.
  if (!topics.empty()) waitForPublishers(topics, deadlineIn(kConnecting));
  if (!topics.empty()) std::this_thread::sleep_for(kFirstNews);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!reason_.empty()) throw replay::MotionRefused(reason_);
}

bool TakeOver::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  if (channel.topic == topic_ && isVelocity(channel)) {
    const replay::Stamp now = stampNow();
    const replay::Velocity velocity = replay::velocityOf(bytes);
    const std::lock_guard<std::mutex> lock(mutex_);
    watch_.told(now, velocity);
    obedience_.told(now, velocity);
  }
  return sink_.publish(channel, bytes);
}

// -------------------------------------------------------------------------------- where to listen

/// Looks for what to listen to; a master that does not answer is asked again.
void TakeOver::scout() {
  if (topic_.empty()) return;
  try {
    const Deadline deadline = deadlineIn(kMasterPatience);
    const std::map<std::string, std::string> types = master_.topicTypes(deadline);
    for (const VelocityRoute& route : velocityRoutes(master_.graph(deadline), types, topic_)) {
      follow(route);
    }
    listenToOdometry(types);
  } catch (const std::exception&) {  // the guard knows what to do without a master
  }
}

void TakeOver::follow(const VelocityRoute& route) {
  for (const std::string& input : route.inputs) listenToInput(input);
  const std::string& output = base_.output_topic.empty() ? route.output : base_.output_topic;
  // Of several nodes one behind the other the last is not known.
  if (!output.empty()) listenToOutput(output, output == route.output ? route.node : "");
  if (route.selected.empty()) return;
  listen<std_msgs::String>(route.selected, [this](const std_msgs::String& selected) {
    return watch_.onSelected(selected.data);
  });
}

/// `look` is called with the lock held.
template <typename Heard>
void TakeOver::listen(const std::string& topic, std::function<std::string(const Heard&)> look) {
  if (topic == topic_ || !heard_.insert(topic).second) return;
  thread_.hear<Heard>(topic, kListenQueue, [this, look = std::move(look)](const Heard& heard) {
    std::string reason;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      reason = look(heard);
      if (reason.empty() || !reason_.empty()) return;
      reason_ = reason;
    }
    on_taken_(reason);
  });
}

void TakeOver::listenToVelocities(const std::string& topic, Look look) {
  listen<AnyMessage>(topic, [look = std::move(look)](const AnyMessage& event) {
    const topic_tools::ShapeShifter& message = *event.getConstMessage();
    if (!replay::isTwist(message.getDataType())) return std::string();
    return look(event.getPublisherName(), replay::velocityOf(bytesOf(message)));
  });
}

void TakeOver::listenToInput(const std::string& topic) {
  listenToVelocities(topic, [this, topic](const auto&, const replay::Velocity& velocity) {
    return watch_.onInput(stampNow(), topic, velocity);
  });
}

/// Only the multiplexer sends there, or the first that was heard if it is not known: whatever
/// another node sends there, zeros too, it passes everybody by.
void TakeOver::listenToOutput(const std::string& topic, const std::string& multiplexer) {
  const auto look = [this, topic, driver = multiplexer](
                        const std::string& sender, const replay::Velocity& velocity) mutable {
    if (driver.empty() && isAnother(sender)) driver = sender;
    if (sender != driver && isAnother(sender)) return sender + " drives the base on " + topic;
    return watch_.onOutput(stampNow(), topic, velocity);
  };
  listenToVelocities(topic, look);
}

/// The profile's, /odom, or the only one there is.
void TakeOver::listenToOdometry(const std::map<std::string, std::string>& types) {
  std::vector<std::string> known;
  for (const auto& [topic, type] : types) {
    if (type == kOdometryType) known.push_back(topic);
  }
  const std::string topic = !base_.odometry_topic.empty()     ? base_.odometry_topic
                            : replay::contains(known, "/odom") ? "/odom"
                            : known.size() == 1               ? known.front()
                                                              : "";
  if (topic.empty()) return;
  listen<nav_msgs::Odometry>(topic, [this](const nav_msgs::Odometry& odometry) {
    const auto& position = odometry.pose.pose.position;
    const auto& q = odometry.pose.pose.orientation;
    return obedience_.moved(stampNow(), toStamp(odometry.header.stamp),
                            {position.x, position.y, replay::headingOf(q.x, q.y, q.z, q.w)});
  });
}

}  // namespace afterglow::nodes
