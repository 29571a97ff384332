#include "nodes/ros2/ros2_bridge_node.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <utility>

#include "nodes/guard/guard_messages.hpp"
#include "nodes/tools/diagnostics.hpp"
#include "replay/messages/definitions.hpp"
#include "replay/messages/text.hpp"
#include "replay/ros2/ros2_definition.hpp"
#include "replay/ros2/twist_stamp.hpp"

namespace afterglow::nodes {
namespace {

constexpr auto kMasterLook = std::chrono::milliseconds(500);
constexpr auto kAnswerLook = std::chrono::milliseconds(20);
constexpr int kMostDepth = 100000;
const std::string kAlone = "meets no node of ROS 2 in ";

/// The endpoint whose type the topic is carried as: of the type that it has already, else the
/// first.
const DdsEndpoint& leading(const std::vector<DdsEndpoint>& endpoints, const std::string& dds_type) {
  const auto same = std::find_if(endpoints.begin(), endpoints.end(),
                                 [&](const auto& one) { return one.type == dds_type; });
  return same == endpoints.end() ? endpoints.front() : *same;
}

bool isVelocity(const std::vector<DdsEndpoint>& readers) {
  return std::any_of(readers.begin(), readers.end(), [](const DdsEndpoint& reader) {
    const auto type = replay::typeOfDds(reader.type);
    return type && !replay::otherTwist(replay::ros1TypeName(*type)).empty();
  });
}

std::string textOf(const replay::Ros2Network& network) {
  return "domain " + std::to_string(network.domain) +
         (network.is_subnet ? ", subnet" : ", machine");
}

bool isOfNode(const DdsEndpoint& endpoint) {
  return !endpoint.qos.is_carried && replay::topicOfDds(endpoint.topic).has_value();
}

template <typename Carried>
void eraseUnlessIn(std::map<std::string, Carried>& carried, const std::set<std::string>& topics) {
  for (auto one = carried.begin(); one != carried.end();) {
    one = topics.count(one->first) > 0 ? std::next(one) : carried.erase(one);
  }
}

}  // namespace

replay::Ros2Network readRos2Network(const ros::NodeHandle& own) {
  return replay::ros2Network(own.param<std::string>("network", ""),
                             [](const char* name) { return std::getenv(name); });
}

Ros2BridgeOptions Ros2BridgeOptions::read(const ros::NodeHandle& own) {
  Ros2BridgeOptions options;
  options.network = readRos2Network(own);
  options.depth = own.param("depth", options.depth);
  if (options.depth < 1 || options.depth > kMostDepth) {
    throw std::invalid_argument("~depth is " + std::to_string(options.depth) + "; expected 1 to " +
                                std::to_string(kMostDepth));
  }
  return options;
}

Ros2BridgeNode::Ros2BridgeNode(const Ros2BridgeOptions& options)
    : options_(options),
      participant_(options.network, "afterglow_ros2_bridge",
                   {[this] { wake(); },
                    [this](const auto& topic, const auto& policy) { tellMisfit(topic, policy); }}),
      types_(participant_, [this] { wake(); }),
      actions_(participant_, types_, refusals_),
      descriptions_(participant_, refusals_, [this] { wake(); }) {
  diagnostics_ = node_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 2);
  mark_ = node_.advertise<std_msgs::String>(ros::this_node::getName() + kRos2BridgeMark, 1, true);
  std_msgs::String network;
  network.data = textOf(options.network);
  mark_.publish(network);
  timer_ = node_.createSteadyTimer(ros::WallDuration(1.0),
                                   [this](const auto&) { publishDiagnostics(); });
  thread_ = std::thread([this] { work(); });
}

Ros2BridgeNode::~Ros2BridgeNode() {
  timer_.stop();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Ros2BridgeNode::tellMisfit(const std::string& topic, const std::string& policy) {
  // Of a topic's readers and writers, one fits each kind of these.
  if (policy == "reliability" || policy == "durability") return;
  refusals_.tell(replay::topicOfDds(topic).value_or(topic),
                 "a node of ROS 2 has another quality of service (" + policy + ")");
}

void Ros2BridgeNode::wake() {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_changed_ = true;
  changed_.notify_all();
}

void Ros2BridgeNode::work() {
  std::unique_lock<std::mutex> lock(mutex_);
  auto asked = std::chrono::steady_clock::time_point::min();
  while (!is_ending_) {
    is_changed_ = false;
    lock.unlock();
    const auto now = std::chrono::steady_clock::now();
    if (now - kMasterLook >= asked) {
      askRos1();
      asked = now;
    }
    const bool is_settled = look();
    lock.lock();
    const auto patience = is_settled ? kMasterLook : kAnswerLook;
    changed_.wait_for(lock, patience, [this] { return is_changed_ || is_ending_; });
  }
}

void Ros2BridgeNode::askRos1() {
  try {
    ros1_ = master_.graph(deadlineIn(kMasterPatience));
    ros1_types_ = master_.topicTypes(deadlineIn(kMasterPatience));
    descriptions_.set();
  } catch (const std::runtime_error& error) {  // what is connected goes on
    ROS_WARN_STREAM_THROTTLE(10, error.what());
  }
}

void Ros2BridgeNode::announce(const std::vector<DdsEndpoint>& all) {
  if (announcement_) return;
  const bool is_before_iron =
      std::all_of(all.begin(), all.end(), [](const auto& one) { return one.type_hash.empty(); });
  const DdsGuid guid = participant_.guid();
  announcement_ = std::make_unique<DdsWriter>(participant_, replay::kNodesTopic, replay::kNodesType,
                                              DdsQos{true, true, 1});
  announcement_->write(replay::nodeAnnouncement({guid.bytes.begin(), guid.bytes.end()},
                                                ros::this_node::getName(), is_before_iron));
}

bool Ros2BridgeNode::look() {
  const std::vector<DdsEndpoint> all = participant_.endpoints();
  const bool has_nodes = std::any_of(all.begin(), all.end(), isOfNode);
  if (has_nodes) announce(all);
  descriptions_.look(all);
  std::map<std::string, Sides> ros2;
  for (const DdsEndpoint& endpoint : all) {
    const auto topic = replay::topicOfDds(endpoint.topic);
    if (!topic || !replay::isBridged(*topic)) continue;
    (endpoint.is_writer ? ros2[*topic].writers : ros2[*topic].readers).push_back(endpoint);
  }
  std::set<std::string> from_ros2, from_ros1;
  for (const auto& [topic, sides] : ros2) {
    if (!sides.writers.empty()) from_ros2.insert(topic);
    // A robot that can be driven is seen to be, before somebody drives it.
    const bool is_wanted = !ros1_.otherPublishers(topic).empty() || isVelocity(sides.readers);
    if (!sides.readers.empty() && is_wanted) from_ros1.insert(topic);
  }
  const std::lock_guard<std::mutex> lock(carried_mutex_);
  is_alone_ = !has_nodes;
  eraseUnlessIn(to_ros2_, from_ros1);
  eraseUnlessIn(to_ros1_, from_ros2);
  bool is_settled = actions_.look(all, {ros1_, ros1_types_});
  for (const auto& [topic, why] : refusals_.whys()) {
    const bool is_there = from_ros1.count(topic) > 0 || from_ros2.count(topic) > 0;
    if (!is_there && !actions_.has(topic)) refusals_.forget(topic);
  }
  for (const auto& [topic, sides] : ros2) {
    try {
      if (from_ros1.count(topic) > 0 && !toRos2(topic, sides.readers, all)) is_settled = false;
      if (from_ros2.count(topic) > 0 && !toRos1(topic, sides.writers, all)) is_settled = false;
    } catch (const std::runtime_error& error) {  // of messages, of DDS, of ROS
      refusals_.tell(topic, error.what());
    }
  }
  return is_settled;
}

bool Ros2BridgeNode::toRos1(const std::string& topic, const std::vector<DdsEndpoint>& writers,
                            const std::vector<DdsEndpoint>& all) {
  auto& carried = to_ros1_[topic];
  const DdsEndpoint& writer = leading(writers, carried ? carried->ddsType() : "");
  if (carried && carried->ddsType() != writer.type) carried.reset();
  if (!carried) {
    const auto type = replay::typeOfDds(writer.type);
    if (!type) throw replay::MessageError("its type is " + writer.type + ", none of ROS 2");
    const auto definition = types_.find(*type, writer, all);
    if (!definition) return false;
    const replay::Ros2Description description{
        topic, *type, "cdr", definition->empty() ? "" : "ros2msg", *definition, ""};
    replay::Ros2Topic conversion(description, replay::findInstalled(),
                                 replay::Ros2Topic::Source::Robot);
    if (!conversion.whyForeign().empty()) {
      ROS_WARN_STREAM(topic << " has the fields of ROS 2: " << conversion.whyForeign());
    }
    carried = std::make_unique<TopicToRos1>(
        participant_, refusals_, std::move(conversion),
        TopicToRos1::Options{writer.type, options_.depth, writer.qos.is_transient_local,
                             [this] { wake(); }});
    refusals_.forget(topic);
  }
  updateToRos1(topic, writers);
  return true;
}

void Ros2BridgeNode::updateToRos1(const std::string& topic,
                                  const std::vector<DdsEndpoint>& writers) {
  TopicToRos1& carried = *to_ros1_.at(topic);
  std::vector<DdsEndpoint> alike;
  for (const DdsEndpoint& writer : writers) {
    if (writer.type == carried.ddsType()) {
      alike.push_back(writer);
    } else {
      refusals_.tell(topic, "it is published on ROS 2 as " + carried.ddsType() + " and as " +
                                writer.type + ", which is left out");
    }
  }
  const auto back = to_ros2_.find(topic);
  const bool is_linked =
      back != to_ros2_.end() && back->second && back->second->hears(carried.ros1Type());
  carried.update(alike, is_linked ? 1 : 0);
}

TopicToRos2::Options Ros2BridgeNode::optionsToRos2(const std::string& topic,
                                                   const std::string& ros2_type,
                                                   const std::vector<DdsEndpoint>& readers) const {
  TopicToRos2::Options options{topic, ros2_type, "", false, options_.depth};
  options.is_transient_local = std::any_of(readers.begin(), readers.end(), [](const auto& reader) {
    return reader.qos.is_transient_local;
  });
  // A subscriber stays with the type that it meets first, and would meet this node's own.
  const auto own = to_ros1_.find(topic);
  const auto told = ros1_types_.find(topic);
  if (own != to_ros1_.end() && own->second && told != ros1_types_.end() &&
      told->second == replay::otherTwist(own->second->ros1Type())) {
    if (const auto known = replay::findInstalled()(told->second)) {
      options.ros1_type = told->second;
      options.ros1_md5 = known->md5;
    }
  }
  return options;
}

bool Ros2BridgeNode::toRos2(const std::string& topic, const std::vector<DdsEndpoint>& readers,
                            const std::vector<DdsEndpoint>& all) {
  auto& carried = to_ros2_[topic];
  const DdsEndpoint& reader =
      leading(readers, carried ? replay::ddsTypeName(carried->options().ros2_type) : "");
  const auto type = replay::typeOfDds(reader.type);
  if (!type) throw replay::MessageError("its type is " + reader.type + ", none of ROS 2");
  TopicToRos2::Options options = optionsToRos2(topic, *type, readers);
  if (carried) {
    const TopicToRos2::Options& now = carried->options();
    if (now.ros2_type != options.ros2_type || now.ros1_type != options.ros1_type ||
        now.is_transient_local != options.is_transient_local) {
      carried.reset();
    }
  }
  if (!carried) {
    const auto definition = types_.find(*type, reader, all);
    if (!definition) return false;
    options.definition = *definition;
    carried = std::make_unique<TopicToRos2>(participant_, refusals_, std::move(options));
  }
  const auto alike = std::count_if(readers.begin(), readers.end(),
                                   [&](const auto& one) { return one.type == reader.type; });
  return carried->update(ros1_.otherPublishers(topic), static_cast<std::size_t>(alike));
}

void Ros2BridgeNode::tellWhetherAlone() {
  const std::lock_guard<std::mutex> lock(carried_mutex_);
  if (is_alone_ && !was_alone_) ROS_WARN_STREAM(kAlone << textOf(options_.network));
  if (!is_alone_ && was_alone_) ROS_INFO_STREAM("meets ROS 2 in " << textOf(options_.network));
  was_alone_ = is_alone_;
}

void Ros2BridgeNode::publishDiagnostics() {
  tellWhetherAlone();
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = ros::Time::now();
  diagnostic_msgs::DiagnosticStatus& status = array.status.emplace_back();
  status.name = ros::this_node::getName().substr(1);
  status.hardware_id = kBridgeHardware;
  std::size_t to_ros1 = 0, to_ros2 = 0;
  bool is_whole = true;
  const auto tell = [&](const std::string& topic, const char* side, const CarriedCount& count) {
    is_whole = is_whole && count.isWhole();
    addValue(status, topic + " to " + side, count.text());
  };
  {
    const std::lock_guard<std::mutex> lock(carried_mutex_);
    for (const auto& [topic, carried] : to_ros1_) {
      if (!carried || !carried->isCarried()) continue;
      ++to_ros1;
      tell(topic, "ROS 1", carried->count());
    }
    for (const auto& [topic, carried] : to_ros2_) {
      if (!carried) continue;
      ++to_ros2;
      tell(topic, "ROS 2", carried->count());
    }
    addValue(status, "on_ros2", std::to_string(to_ros1_.size()));
    addValue(status, "actions", std::to_string(actions_.count()));
  }
  addValue(status, "to_ros1", std::to_string(to_ros1));
  addValue(status, "to_ros2", std::to_string(to_ros2));
  const auto whys = refusals_.whys();
  const auto bad = refusals_.badMessages();
  for (const auto& [topic, why] : whys) addValue(status, topic, why);
  for (const auto& [topic, count] : bad) {
    addValue(status, topic, replay::counted(count, "message") + " left out");
  }
  const bool is_well = whys.empty() && bad.empty() && is_whole && !was_alone_;
  status.level =
      is_well ? diagnostic_msgs::DiagnosticStatus::OK : diagnostic_msgs::DiagnosticStatus::WARN;
  status.message = "carries " + replay::counted(to_ros1, "topic") + " to ROS 1, " +
                   std::to_string(to_ros2) + " to ROS 2";
  if (!whys.empty()) status.message += "; refuses " + std::to_string(whys.size());
  if (was_alone_) status.message = kAlone + textOf(options_.network);
  diagnostics_.publish(array);
}

}  // namespace afterglow::nodes
