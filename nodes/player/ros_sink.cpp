#include "nodes/player/ros_sink.hpp"

#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

#include "nodes/player/watchdog.hpp"
#include "replay/messages/field_edit.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/motion/stops/stop_maker.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kQueue = 100;  // of what is listened to
/// Whoever drives a base sends more often: it would stop after 0.25 s.
constexpr double kDriverPeriod = 0.4;
/// The time between looks at what was heard on the velocity topics.
constexpr double kDriverLook = 0.02;

}  // namespace

RosSink::RosSink(const replay::PlayPlan& plan, std::uint32_t queue, Listener listener)
    : queue_size_(queue), listener_(std::move(listener)) {
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (!topic.isPlayed()) {
      continue;
    }
    played_.push_back(topic.output.topic);
    Output& output = advertise(topic.output);
    if (replay::isGoal(topic.output)) {
      advertise(replay::cancelChannel(topic.output));
      watchGoals(topic.output);
      if (const auto halt = replay::haltChannel(topic.output)) advertise(*halt);
    }
    const replay::StopMaker stop(topic.output, stopOf(topic));
    advertise(stop.channel());
    if (stop.isSetPoint()) {
      watchDrivers(topic.output.topic, output);
    }
  }
  if (!velocities_.empty()) thread_.every(kDriverLook, [this] { drivers_.callRest(); });
  thread_.begin();
}

RosSink::Output& RosSink::advertise(const replay::Channel& channel) {
  Output& output = outputs_[channel.topic];
  if (!output.publishers.empty()) {
    return output;  // a cancel topic that was recorded, too
  }
  output.message.morph(channel.md5, channel.type, channel.definition, channel.latching ? "1" : "0");
  publisherOf(output, channel);
  return output;
}

ros::Publisher& RosSink::publisherOf(Output& output, const replay::Channel& channel) {
  const bool latches = channel.latching;
  ros::Publisher& publisher = output.publishers[{latches, latches ? channel.caller_id : ""}];
  if (!publisher) {
    publisher = output.message.advertise(node_, channel.topic, queue_size_, latches);
  }
  return publisher;
}

void RosSink::watchGoals(const replay::Channel& goal_channel) {
  const std::string action = replay::actionOf(goal_channel.topic);
  using Statuses = actionlib_msgs::GoalStatusArray;
  thread_.hear<Statuses>(action + "/status", kQueue,
                         [this](const Statuses& statuses) { onStatus(statuses); });
  thread_.hear<AnyMessage>(action + "/result", kQueue,
                           [this](const AnyMessage& event) { onResult(event); });
}

void RosSink::watchDrivers(const std::string& topic, Output& output) {
  drivers_.hear<AnyMessage>(topic, kQueue, [this, topic](const AnyMessage& event) {
    const std::string& driver = event.getPublisherName();
    if (isAnother(driver) && !has_second_driver_.exchange(true)) {
      listener_.on_second_driver(driver + " drives on " + topic +
                                 ", too: two drivers of one base are refused");
    }
  });
  velocities_.push_back(topic);
  output.own_subscribers = 1;
}

void RosSink::listenForDrivers() {
  const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
  const auto isAlone = [&](const auto& topic) { return graph.otherPublishers(topic).empty(); };
  if (replay::allOf(velocities_, isAlone)) return;
  waitForPublishers(velocities_, deadlineIn(kMasterPatience));
  waitUntil(deadlineIn(kDriverPeriod), [this] { return has_second_driver_.load(); });
}

void RosSink::onStatus(const actionlib_msgs::GoalStatusArray& statuses) {
  for (const actionlib_msgs::GoalStatus& status : statuses.status_list) {
    // Its result, which says more, is sent before; it is not waited for: the goal may go on.
    listener_.on_goal_status(status.goal_id.id, replay::GoalEnd(status.status, status.text));
  }
}

void RosSink::onResult(const AnyMessage& event) {
  const auto& message = event.getConstMessage();
  try {
    const auto [id, end] = replay::readResult(
        message->getDataType(), message->getMessageDefinition(), bytesOf(*message));
    listener_.on_goal_status(id, end);
  } catch (const replay::MessageError&) {  // its status tells of it
  }
}

std::vector<std::string> RosSink::waitForSubscribers(Deadline deadline,
                                                     const std::function<bool()>& is_stopped) {
  for (;;) {
    const RosGraph graph = askMaster(deadline + std::chrono::seconds(2));
    std::vector<std::string> unheard;
    bool is_connected = true;
    for (const std::string& topic : played_) {
      const std::size_t heard_by = outputs_.at(topic).heardBy();
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
  const std::lock_guard<std::mutex> lock(publishing_);
  // ShapeShifter copies; the stream's interface wants a pointer that it does not write through.
  ros::serialization::IStream stream(const_cast<std::uint8_t*>(bytes.data()),
                                     static_cast<std::uint32_t>(bytes.size()));
  output.message.read(stream);
  publisherOf(output, channel).publish(output.message);
  return output.heardBy() > 0;
}

namespace {

constexpr std::uint32_t kAnswerQueue = 10;

}  // namespace

RateControl::RateControl(const RateControlOptions& options, const replay::PlayPlan& plan,
                         bool has_recorded_time, replay::MessageSink& next, Replay replay)
    : topic_(options.topic),
      next_(next),
      replay_(std::move(replay)),
      lag_(options.longest_delay_s, plan.begin, has_recorded_time) {
  thread_.hear<Answer>(topic_, kAnswerQueue, [this](const Answer& answer) { onAnswer(answer); });
  thread_.begin();
}

bool RateControl::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  const replay::Stamp position = replay_.position();
  const bool is_heard = next_.publish(channel, bytes);
  follow([&] { lag_.onPublished(position, replay_.now()); });
  return is_heard;
}

void RateControl::onAnswer(const Answer& answer) {
  const ros::M_string& connection = answer.getConnectionHeader();
  const std::string& type = connection.at("type");
  try {
    if (!schema_ || schema_->root().name != type) {
      schema_ = replay::Schema::parse(type, connection.at("message_definition"));
    }
    const auto stamp = replay::headerStamp(*schema_, answer.getMessage()->bytes);
    if (stamp) return follow([&] { lag_.onAnswer(*stamp); });
  } catch (const replay::MessageError&) {  // likewise
  }
  replay_.stop(topic_ + " is to control the rate, but " + type + " does not begin with a header");
}

/// The replay is told by one thread at a time, in the order in which things changed.
void RateControl::follow(const std::function<void()>& change) {
  const std::lock_guard<std::mutex> lock(mutex_);
  change();
  if (lag_.isBehind() != is_held_) {
    is_held_ = !is_held_;
    replay_.hold(is_held_);
  }
}

}  // namespace afterglow::nodes
