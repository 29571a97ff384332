#include "nodes/ros2/action_on_ros1.hpp"

#include <actionlib_msgs/GoalID.h>
#include <actionlib_msgs/GoalStatusArray.h>

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <utility>

namespace afterglow::nodes {
namespace {

using replay::ActionTopic;

constexpr std::uint32_t kQueue = 50;

const char* nameOf(ActionTopic topic) {
  constexpr const char* kNames[] = {"goal", "cancel", "status", "feedback", "result"};
  return kNames[static_cast<std::size_t>(topic)];
}

template <typename Ros>
replay::Channel channelOf() {
  namespace traits = ros::message_traits;
  return {"",
          traits::DataType<Ros>::value(),
          traits::MD5Sum<Ros>::value(),
          traits::Definition<Ros>::value(),
          false,
          ""};
}

}  // namespace

ActionOnRos1::ActionOnRos1(std::string action) : action_(std::move(action)) {}

const replay::Channel& ActionOnRos1::cancel() {
  static const auto kChannel = channelOf<actionlib_msgs::GoalID>();
  return kChannel;
}

const replay::Channel& ActionOnRos1::status() {
  static const auto kChannel = channelOf<actionlib_msgs::GoalStatusArray>();
  return kChannel;
}

void ActionOnRos1::post(Task task, std::size_t most_waiting) {
  const auto guarded = [this, task = std::move(task)] {
    try {
      task({static_cast<std::int64_t>(ros::Time::now().toNSec())});
    } catch (const std::runtime_error& error) {  // of DDS, of ROS
      ROS_WARN_STREAM_THROTTLE(1, action_ << ": " << error.what());
    }
  };
  const bool has_room = thread_.post(guarded, most_waiting);
  if (!has_room) ROS_WARN_STREAM_THROTTLE(1, action_ << ": more comes than can be carried");
}

void ActionOnRos1::postTicks(const Task& task) {
  timer_ = node_.createSteadyTimer(ros::WallDuration(1.0 / replay::kActionTicksPerSecond),
                                   [this, task](const auto&) { post(task); });
}

void ActionOnRos1::deafen() {
  timer_.stop();
  subscribers_.clear();
}

void ActionOnRos1::advertise(ActionTopic topic, const replay::Channel& channel) {
  ros::AdvertiseOptions options(action_ + "/" + nameOf(topic), kQueue, channel.md5, channel.type,
                                channel.definition);
  options.latch = topic == ActionTopic::Status;  // as actionlib's
  publishers_[topic] = node_.advertise(options);
}

void ActionOnRos1::subscribe(ActionTopic topic, const replay::Channel& channel, const Take& take) {
  ros::SubscribeOptions options;
  options.initByFullCallbackType<const Event&>(
      action_ + "/" + nameOf(topic), kQueue, [this, take](const Event& event) {
        if (event.getPublisherName() == ros::this_node::getName()) return;  // from ROS 2
        post([take, bytes = event.getConstMessage()->bytes](replay::Stamp now) {
          take(bytes, now);
        });
      });
  options.md5sum = channel.md5;
  options.datatype = channel.type;
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  subscribers_.push_back(node_.subscribe(options));
}

void ActionOnRos1::publish(ActionTopic topic, const replay::Bytes& ros1) const {
  const auto publisher = publishers_.find(topic);
  if (publisher != publishers_.end()) publisher->second.publish(RawMessage{ros1});
}

bool ActionOnRos1::isMet() const {
  const auto is_heard = [](const auto& one) { return one.second.getNumSubscribers() > 0; };
  const auto is_told = [](const auto& one) { return one.getNumPublishers() > 0; };
  return std::all_of(publishers_.begin(), publishers_.end(), is_heard) &&
         std::all_of(subscribers_.begin(), subscribers_.end(), is_told);
}

}  // namespace afterglow::nodes
