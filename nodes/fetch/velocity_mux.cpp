#include "nodes/fetch/velocity_mux.hpp"

#include <std_msgs/String.h>

#include <algorithm>
#include <utility>

namespace afterglow::nodes {
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
