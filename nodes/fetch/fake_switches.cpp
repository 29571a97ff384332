#include "nodes/fetch/fake_switches.hpp"

#include <std_msgs/Header.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "replay/messages/definitions.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kStatePeriod = 0.1;  // s
const std::string kStateType = "afterglow/SimulatedRobotState";
const std::string kStateDefinition =
    "std_msgs/Header header\nbool ready\nbool faulted\nbool runstopped\n" + std::string(80, '=') +
    "\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

}  // namespace

Runstop::Runstop(std::function<void()> on_press) : on_press_(std::move(on_press)) {
  enabled_publisher_ = node_.advertise<std_msgs::Bool>("software_runstop_enabled", 10);
  state_.morph(replay::definitionMd5(kStateType, kStateDefinition), kStateType, kStateDefinition,
               "0");
  state_publisher_ = state_.advertise(node_, "robot_state", 10);
  subscriber_ = node_.subscribe<std_msgs::Bool>(
      "enable_software_runstop", 10, [this](const auto& word) { onWord(word->data != 0); });
  timer_ = node_.createWallTimer(ros::WallDuration(kStatePeriod),
                                 [this](const ros::WallTimerEvent&) { publish(); });
}

bool Runstop::isPressed() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return is_pressed_;
}

void Runstop::onWord(bool is_pressed) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_pressed_ = is_pressed;
  }
  if (is_pressed) on_press_();
  publish();
}

void Runstop::publish() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std_msgs::Bool enabled;
  enabled.data = is_pressed_;
  enabled_publisher_.publish(enabled);
  std_msgs::Header header;
  header.seq = sequence_++;
  header.stamp = ros::Time::now();
  const std::uint32_t size = ros::serialization::serializationLength(header) + 3;
  std::vector<std::uint8_t> bytes(size);
  ros::serialization::OStream out(bytes.data(), size);
  out.next(header);
  for (const bool value : {!is_pressed_, false, is_pressed_}) {
    out.next(static_cast<std::uint8_t>(value));
  }
  ros::serialization::IStream in(bytes.data(), size);
  state_.read(in);
  state_publisher_.publish(state_);
}

namespace {

constexpr const char* kNoInput = "__none";

}  // namespace

const std::string& VelocityMux::output() {
  static const std::string topic = "base_controller/command";
  return topic;
}

VelocityMux::VelocityMux(const std::vector<std::string>& inputs) {
  for (const std::string& topic : inputs) inputs_.push_back(node_.resolveName(topic));
  output_ = node_.advertise<geometry_msgs::Twist>(output(), 10);
  selected_publisher_ = node_.advertise<std_msgs::String>("cmd_vel_mux/selected", 1, true);
  select(inputs_.front());
  for (const std::string& topic : inputs_) {
    subscribers_.push_back(
        node_.subscribe<geometry_msgs::Twist>(topic, 10, [this, topic](const auto& twist) {
          const std::lock_guard<std::mutex> lock(mutex_);
          if (topic == selected_) output_.publish(*twist);
        }));
  }
  service_ = node_.advertiseService("cmd_vel_mux/select", &VelocityMux::onSelect, this);
}

void VelocityMux::select(const std::string& topic) {
  std_msgs::String message;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    message.data = selected_ = topic;
  }
  selected_publisher_.publish(message);
}

bool VelocityMux::onSelect(topic_tools::MuxSelect::Request& request,
                           topic_tools::MuxSelect::Response& response) {
  const bool is_known = request.topic == kNoInput ||
                        std::count(inputs_.begin(), inputs_.end(), request.topic) > 0;
  if (!is_known) return false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    response.prev_topic = selected_;
  }
  select(request.topic);
  return true;
}

}  // namespace afterglow::nodes
