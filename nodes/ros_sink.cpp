#include "nodes/ros_sink.hpp"

#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kQueue = 100;

bool isActionGoal(const replay::Channel& channel) {
  const std::string& type = channel.type;
  const std::string ending = "ActionGoal";
  return type.size() > ending.size() &&
         type.compare(type.size() - ending.size(), ending.size(), ending) == 0;
}

}  // namespace

RosSink::RosSink(const replay::PlayPlan& plan, OnGoalStatus on_goal_status)
    : played_(plan.playedTopics()),
      on_goal_status_(std::move(on_goal_status)),
      spinner_(1, &queue_) {
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (!topic.isPlayed()) {
      continue;
    }
    advertise(topic.channel);
    if (isActionGoal(topic.channel)) {
      advertise(replay::cancelChannel(topic.channel));
      watch(topic.channel);
    }
  }
  spinner_.start();
}

RosSink::~RosSink() {
  for (ros::Subscriber& status : statuses_) {
    status.shutdown();
  }
  spinner_.stop();
}

void RosSink::advertise(const replay::Channel& channel) {
  Output& output = outputs_[channel.topic];
  if (output.publisher) {
    return;  // a cancel topic that was recorded, too
  }
  output.message.morph(channel.md5, channel.type, channel.definition, channel.latching ? "1" : "0");
  output.publisher = output.message.advertise(node_, channel.topic, kQueue, channel.latching);
}

void RosSink::watch(const replay::Channel& goal_channel) {
  const std::string action = goal_channel.topic.substr(0, goal_channel.topic.rfind('/'));
  ros::SubscribeOptions options;
  options.initByFullCallbackType<const actionlib_msgs::GoalStatusArray&>(
      action + "/status", kQueue,
      [this](const actionlib_msgs::GoalStatusArray& statuses) { onStatus(statuses); });
  options.callback_queue = &queue_;
  statuses_.push_back(node_.subscribe(options));
}

void RosSink::onStatus(const actionlib_msgs::GoalStatusArray& statuses) {
  for (const actionlib_msgs::GoalStatus& status : statuses.status_list) {
    on_goal_status_(status.goal_id.id, status.status);
  }
}

std::vector<std::string> RosSink::waitForSubscribers(Deadline deadline,
                                                     const std::function<bool()>& is_stopped) {
  for (;;) {
    const RosGraph graph = askMaster(deadline + std::chrono::seconds(2));
    std::vector<std::string> unheard;
    bool is_connected = true;
    for (const std::string& topic : played_) {
      const std::size_t heard_by = outputs_.at(topic).publisher.getNumSubscribers();
      if (heard_by == 0) unheard.push_back(topic);
      is_connected =
          is_connected && heard_by > 0 && heard_by >= graph.otherSubscribers(topic).size();
    }
    if (is_connected || is_stopped() || std::chrono::steady_clock::now() >= deadline) {
      return unheard;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

bool RosSink::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  const auto found = outputs_.find(channel.topic);
  if (found == outputs_.end()) {
    throw std::logic_error("not advertised: " + channel.topic);
  }
  Output& output = found->second;
  // ShapeShifter copies; the stream's interface wants a pointer that it does not write through.
  ros::serialization::IStream stream(const_cast<std::uint8_t*>(bytes.data()),
                                     static_cast<std::uint32_t>(bytes.size()));
  output.message.read(stream);
  output.publisher.publish(output.message);
  return output.publisher.getNumSubscribers() > 0;
}

}  // namespace afterglow::nodes
