#include "nodes/player/replay_time.hpp"

#include <stdexcept>
#include <string>

namespace afterglow::nodes {

ReplayTime::ReplayTime(ReplayClock kind) {
  const std::string other = clockPublisher();
  if (kind == ReplayClock::Sim && !other.empty()) {
    throw std::runtime_error(other + " publishes /clock, too: two clocks are refused");
  }
  if (kind == ReplayClock::Follow || (kind == ReplayClock::Live && ros::Time::isSimTime())) {
    followed_ = std::make_unique<replay::FollowedClock>();
    follower_.emplace(*followed_);
  } else {
    own_ = std::make_unique<replay::SteadyClock>();
  }
}

replay::Clock& ReplayTime::clock() {
  return followed_ ? static_cast<replay::Clock&>(*followed_) : *own_;
}

replay::Stamp ReplayTime::now() const {
  return followed_ ? followed_->time()
                   : replay::Stamp{static_cast<std::int64_t>(ros::Time::now().toNSec())};
}

}  // namespace afterglow::nodes
