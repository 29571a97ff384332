#include "nodes/console/foxglove_live.hpp"

#include <ros/param.h>
#include <topic_tools/shape_shifter.h>

#include <chrono>
#include <exception>
#include <iterator>
#include <utility>
#include <vector>

namespace afterglow::nodes {
namespace {

constexpr std::chrono::milliseconds kTimePeriod{100};
constexpr int kTicksToLook = 10;
/// The words of Foxglove's own bridge, which tools know and explain.
constexpr const char* kLost = "Send buffer limit reached";
constexpr double kBack_s = 1;  // a time so much earlier is a new one: a simulation began anew

nlohmann::json jsonOf(XmlRpc::XmlRpcValue& value) {
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return static_cast<bool>(value);
    case XmlRpc::XmlRpcValue::TypeInt:
      return static_cast<int>(value);
    case XmlRpc::XmlRpcValue::TypeDouble:
      return static_cast<double>(value);
    case XmlRpc::XmlRpcValue::TypeString:
      return static_cast<std::string>(value);
    case XmlRpc::XmlRpcValue::TypeArray: {
      auto array = nlohmann::json::array();
      for (int i = 0; i < value.size(); ++i) array.push_back(jsonOf(value[i]));
      return array;
    }
    case XmlRpc::XmlRpcValue::TypeStruct: {
      auto object = nlohmann::json::object();
      for (auto& [name, member] : value) object[name] = jsonOf(member);
      return object;
    }
    default:
      return nullptr;
  }
}

void addParameters(const std::string& name, XmlRpc::XmlRpcValue& value, FoxgloveParameters& told) {
  if (value.getType() != XmlRpc::XmlRpcValue::TypeStruct) {
    told[name] = jsonOf(value);
    return;
  }
  for (auto& [part, member] : value) addParameters(name + "/" + part, member, told);
}

}  // namespace

// ------------------------------------------------------------------------------------------ topics

FoxgloveLive::FoxgloveLive() : spinner_(1, &queue_), thread_(kTimePeriod, [this] { tick(); }) {
  node_.setCallbackQueue(&queue_);
  spinner_.start();
  thread_.begin();
}

void FoxgloveLive::join(FoxgloveLiveSession& session) {
  const std::lock_guard<std::mutex> look_lock(look_mutex_);
  look();
  std::vector<FoxgloveChannel> channels;
  for (const auto& [topic, channel] : announced_) channels.push_back(channel);
  session.addChannels(channels);
  const std::lock_guard<std::mutex> lock(sessions_mutex_);
  sessions_.insert(&session);
}

void FoxgloveLive::leave(FoxgloveLiveSession& session) {
  const std::lock_guard<std::mutex> lock(sessions_mutex_);
  sessions_.erase(&session);
}

void FoxgloveLive::tick() {
  {
    const std::lock_guard<std::mutex> lock(sessions_mutex_);
    if (sessions_.empty()) return;
    for (FoxgloveLiveSession* session : sessions_) session->tellTime();
  }
  if (++ticks_ % kTicksToLook != 0) return;
  const std::lock_guard<std::mutex> lock(look_mutex_);
  look();
}

/// Without a master everything stays as it is.
void FoxgloveLive::look() {
  Types types;
  try {
    types = master_.topicTypes(deadlineIn(kMasterPatience));
    const RosGraph graph = master_.graph(deadlineIn(kMasterPatience));
    for (auto at = types.begin(); at != types.end();) {
      at = graph.publishers.count(at->first) == 0 ? types.erase(at) : std::next(at);
    }
  } catch (const std::exception&) {
    return;
  }
  change(types);
}

void FoxgloveLive::change(const Types& types) {
  std::vector<FoxgloveChannel> come;
  std::vector<std::uint32_t> gone;
  for (auto at = announced_.begin(); at != announced_.end();) {
    const auto type = types.find(at->first);
    const bool stays = type != types.end() && type->second == at->second.type;
    if (!stays) gone.push_back(at->second.id);
    at = stays ? std::next(at) : announced_.erase(at);
  }
  for (auto at = unknown_.begin(); at != unknown_.end();) {
    at = types.count(at->first) == 0 ? unknown_.erase(at) : std::next(at);
  }
  for (const auto& [topic, type] : types) {
    if (announced_.count(topic) > 0 || announced_.size() >= kMostTopics) continue;
    const auto definition = definitionOf(topic, type);
    if (!definition) continue;
    const FoxgloveChannel channel{++channels_ever_, topic, type, definition->text, definition->md5};
    announced_[topic] = channel;
    come.push_back(channel);
  }
  const std::lock_guard<std::mutex> lock(sessions_mutex_);
  for (FoxgloveLiveSession* session : sessions_) {
    if (!gone.empty()) session->removeChannels(gone);
    if (!come.empty()) session->addChannels(come);
  }
}

/// Empty as long as the type is not known: then the topic is listened to.
std::optional<replay::Definition> FoxgloveLive::definitionOf(const std::string& topic,
                                                             const std::string& type) {
  std::optional<replay::Definition> known;
  {
    const std::lock_guard<std::mutex> lock(definitions_mutex_);
    auto [at, is_new] = definitions_.try_emplace(type);
    if (is_new) at->second = find_installed_(type);
    known = at->second;
  }
  if (known) {
    unknown_.erase(topic);
  } else if (ros::Subscriber& subscriber = unknown_[topic]; !subscriber) {
    ros::SubscribeOptions options;
    options.initByFullCallbackType<const AnyMessage&>(
        topic, 1, [this](const AnyMessage& event) { learn(event); });
    subscriber = node_.subscribe(options);
  }
  return known;
}

void FoxgloveLive::learn(const AnyMessage& event) {
  const topic_tools::ShapeShifter& message = *event.getConstMessage();
  const std::lock_guard<std::mutex> lock(definitions_mutex_);
  const auto wanted = definitions_.find(message.getDataType());
  if (wanted == definitions_.end() || wanted->second) return;
  wanted->second = {message.getMessageDefinition(), message.getMD5Sum()};
}

// ---------------------------------------------------------------------------------------- a client

FoxgloveLiveSession::FoxgloveLiveSession(std::shared_ptr<FoxgloveLive> live,
                                         std::shared_ptr<FrameQueue> frames)
    : FoxgloveSession(std::move(frames)), live_(std::move(live)) {
  greet({"Afterglow: " + ros::this_node::getName(), {"time", "parameters"}, {}}, {});
  tellTime();
  live_->join(*this);
}

FoxgloveLiveSession::~FoxgloveLiveSession() { live_->leave(*this); }

ros::Time FoxgloveLiveSession::tellTime() {
  const std::lock_guard<std::mutex> lock(told_mutex_);
  const ros::Time now = ros::Time::now();
  if (now <= told_ && (told_ - now).toSec() < kBack_s) return now;
  told_ = now;
  frames().push(timeFrame({static_cast<std::int64_t>(now.toNSec())}));
  return now;
}

void FoxgloveLiveSession::begin(const FoxgloveSubscription& subscription,
                                const FoxgloveChannel& channel) {
  ros::SubscribeOptions options;
  const auto take = [this, id = subscription.id, md5 = channel.md5](const AnyMessage& event) {
    const topic_tools::ShapeShifter& message = *event.getConstMessage();
    if (message.getMD5Sum() == md5) pass(id, message);
  };
  options.initByFullCallbackType<const AnyMessage&>(channel.topic, 0, take);
  immediately_.take(options);
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  ros::Subscriber& subscriber = subscribers_[subscription.id];
  subscriber = live_->node().subscribe(options);
  if (!subscriber) {
    say(FoxgloveLevel::Error, "no ROS master answers: nothing comes of " + channel.topic);
  }
}

/// In roscpp's network thread, but for what is latched, or published by this process.
void FoxgloveLiveSession::pass(std::uint32_t subscription,
                               const topic_tools::ShapeShifter& message) {
  const auto now = static_cast<std::int64_t>(tellTime().toNSec());
  std::string frame = messageFrame(subscription, {now}, message.size());
  ros::serialization::OStream stream(reinterpret_cast<std::uint8_t*>(frame.data()) + kMessageOffset,
                                     message.size());
  message.write(stream);
  if (frames().pushLive(std::move(frame)) == 0) return;
  const std::lock_guard<std::mutex> lock(told_mutex_);
  const ros::SteadyTime at = ros::SteadyTime::now();
  if ((at - lost_).toSec() < 1) return;
  lost_ = at;
  say(FoxgloveLevel::Warning, kLost);
}

FoxgloveParameters FoxgloveLiveSession::parameters() {
  FoxgloveParameters told;
  XmlRpc::XmlRpcValue tree;
  if (ros::param::get("/", tree)) addParameters("", tree, told);
  return told;
}

}  // namespace afterglow::nodes
