#include "nodes/player/live_joints.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nodes/player/ros_clock.hpp"
#include "replay/plan/refusal_text.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kJointLook = 0.02;  // s

}  // namespace

LiveJoints::LiveJoints(const std::vector<std::string>& topics) {
  for (const std::string& topic : topics) {
    thread_.hear<sensor_msgs::JointState>(topic, 100,
                                          [this](const auto& message) { onJoints(message); });
  }
  thread_.begin();
}

std::optional<replay::LiveJoint> LiveJoints::find(const std::string& joint) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto told = joints_.find(joint);
  const bool is_fresh = told != joints_.end() && !told->second.watch.isOverdue(robotNow());
  return is_fresh ? std::optional(told->second.joint) : std::nullopt;
}

void LiveJoints::watch(std::function<std::vector<std::string>()> moving,
                       std::function<void(const std::string&)> on_silence) {
  const auto look = [this, moving = std::move(moving), on_silence = std::move(on_silence)] {
    std::vector<std::string> silent;
    for (const std::string& joint : moving()) {
      const std::lock_guard<std::mutex> lock(mutex_);
      const auto told = joints_.find(joint);
      const bool is_silent = told != joints_.end() && told->second.watch.isOverdue(robotNow());
      if (is_silent) silent.push_back(joint);
    }
    if (silent.empty()) return;
    timer_.stop();
    on_silence("joint states fell silent in motion: nobody tells where " +
               replay::someOf(silent) + " is");
  };
  timer_ = thread_.every(kJointLook, look);
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
    Told& told = joints_[message.name[i]];
    told.joint = {message.position[i], std::isfinite(velocity) ? velocity : 0};
    told.watch.heard(now);
  }
}

}  // namespace afterglow::nodes
