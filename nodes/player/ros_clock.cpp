#include "nodes/player/ros_clock.hpp"

#include <rosgraph_msgs/Clock.h>

#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kClockTopic = "/clock";
/// Slow simulations tell ten times a second.
constexpr std::int64_t kLongestTick = 1'000'000'000;

}  // namespace

ClockGiver::ClockGiver(double hz, std::function<replay::Stamp()> time)
    : publisher_(node_.advertise<rosgraph_msgs::Clock>(kClockTopic, 1, true)) {
  thread_.every(1 / hz, [this, time = std::move(time)] {
    rosgraph_msgs::Clock message;
    message.clock = toTime(time());
    publisher_.publish(message);
  });
  thread_.begin();
}

replay::SteadyTime robotNow() {
  if (ros::Time::isSimTime()) return {rosStampNow().ns};
  const auto steady = std::chrono::steady_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(steady).count()};
}

replay::Stamp rosStampNow() { return toStamp(ros::Time::now()); }

RobotPatience::RobotPatience(double seconds)
    : begin_(robotNow()), ns_(static_cast<std::int64_t>(seconds * 1e9)) {}

bool RobotPatience::isOver() const {
  const std::int64_t passed_ns = robotNow().ns - begin_.ns;
  return passed_ns < 0 || passed_ns >= ns_;
}

ReplayTime::ReplayTime(ReplayClock kind, std::function<void(double seconds)> on_jump) {
  const std::string other = clockPublisher();
  if (kind == ReplayClock::Sim && !other.empty()) {
    throw std::runtime_error(other + " publishes /clock, too: two clocks are refused");
  }
  if (kind == ReplayClock::Live) requireTime(deadlineIn(kMasterPatience));
  const bool is_simulated = kind == ReplayClock::Live && ros::Time::isSimTime();
  if (is_simulated) note_ = "time was the /clock of " + other + ", as /use_sim_time is set";
  if (kind != ReplayClock::Follow && !is_simulated) {
    own_ = std::make_unique<replay::SteadyClock>();
    return;
  }
  followed_ = std::make_unique<replay::FollowedClock>();
  const auto take = [this, on_jump = std::move(on_jump)](const rosgraph_msgs::Clock& message) {
    const std::int64_t step_ns = followed_->tick(toStamp(message.clock));
    if (step_ns < 0 || step_ns > kLongestTick) on_jump(static_cast<double>(step_ns) * 1e-9);
  };
  thread_.hear<rosgraph_msgs::Clock>(kClockTopic, 1, take, ros::TransportHints().tcpNoDelay());
  thread_.begin();
}

replay::Clock& ReplayTime::clock() {
  return followed_ ? static_cast<replay::Clock&>(*followed_) : *own_;
}

replay::Stamp ReplayTime::now() const { return followed_ ? followed_->time() : rosStampNow(); }

}  // namespace afterglow::nodes
