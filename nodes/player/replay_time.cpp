#include "nodes/player/replay_time.hpp"

#include <stdexcept>
#include <string>
#include <utility>

#include "nodes/tools/robot_time.hpp"

namespace afterglow::nodes {

ReplayTime::ReplayTime(ReplayClock kind, std::function<void(double seconds)> on_jump) {
  const std::string other = clockPublisher();
  if (kind == ReplayClock::Sim && !other.empty()) {
    throw std::runtime_error(other + " publishes /clock, too: two clocks are refused");
  }
  if (kind == ReplayClock::Live) requireTime(deadlineIn(kMasterPatience));
  const bool is_simulated = kind == ReplayClock::Live && ros::Time::isSimTime();
  if (is_simulated) note_ = "time was the /clock of " + other + ", as /use_sim_time is set";
  if (kind == ReplayClock::Follow || is_simulated) {
    followed_ = std::make_unique<replay::FollowedClock>();
    follower_.emplace(*followed_, std::move(on_jump));
  } else {
    own_ = std::make_unique<replay::SteadyClock>();
  }
}

replay::Clock& ReplayTime::clock() {
  return followed_ ? static_cast<replay::Clock&>(*followed_) : *own_;
}

replay::Stamp ReplayTime::now() const {
  return followed_ ? followed_->time() : rosStampNow();
}

}  // namespace afterglow::nodes
