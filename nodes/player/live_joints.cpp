#include "nodes/player/live_joints.hpp"

#include <algorithm>
#include <cmath>

#include "nodes/player/ros_clock.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::int64_t kFreshNs = 500'000'000;

}  // namespace

LiveJoints::LiveJoints(const std::vector<std::string>& topics) : spinner_(1, &queue_) {
  node_.setCallbackQueue(&queue_);
  for (const std::string& topic : topics) {
    subscribers_.push_back(node_.subscribe<sensor_msgs::JointState>(
        topic, 100, [this](const auto& message) { onJoints(*message); }));
  }
  spinner_.start();
}

LiveJoints::~LiveJoints() {
  for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
  spinner_.stop();
}

std::optional<replay::LiveJoint> LiveJoints::find(const std::string& joint) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto told = joints_.find(joint);
  const bool is_fresh =
      told != joints_.end() && robotNow() <= told->second.at.after(kFreshNs);
  return is_fresh ? std::optional(told->second.joint) : std::nullopt;
}

std::map<std::string, double> LiveJoints::positions() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::map<std::string, double> positions;
  for (const auto& [name, told] : joints_) positions[name] = told.joint.position;
  return positions;
}

void LiveJoints::onJoints(const sensor_msgs::JointState& message) {
  const replay::SteadyTime now = robotNow();
  const std::lock_guard<std::mutex> lock(mutex_);
  for (std::size_t i = 0; i < std::min(message.name.size(), message.position.size()); ++i) {
    if (!std::isfinite(message.position[i])) continue;
    const double velocity = i < message.velocity.size() ? message.velocity[i] : 0;
    joints_[message.name[i]] = {{message.position[i], std::isfinite(velocity) ? velocity : 0}, now};
  }
}

}  // namespace afterglow::nodes
