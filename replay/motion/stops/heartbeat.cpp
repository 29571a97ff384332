#include "replay/motion/stops/heartbeat.hpp"

#include <utility>

namespace afterglow {
namespace replay {

void HeartbeatMonitor::beat(SteadyTime now, Outputs moving, SteadyTime sent) {
  if (state_ == State::Watching) {
    const std::int64_t gap_ns = sent.ns - last_sent_.ns;
    const bool has_hung = !moving_.empty() && options_.longest_silence_ns < gap_ns;
    if (has_hung) {
      moving_.insert(moving.begin(), moving.end());
      stopForSilence(now);
    } else {
      moving_ = std::move(moving);
    }
    last_beat_ = now;
    last_sent_ = sent;
  } else if (state_ == State::Over && !reason_.empty() && !moving.empty()) {
    moving_ = std::move(moving);
    brake(now);
  }
}

void HeartbeatMonitor::stop(SteadyTime now, const std::string& reason) {
  if (state_ != State::Watching) {
    return;
  }
  reason_ = reason;
  state_ = State::Over;
  if (!moving_.empty()) brake(now);
}

void HeartbeatMonitor::brake(SteadyTime now) {
  state_ = State::Braking;
  next_brake_ = now;
  braking_end_ = now.after(options_.braking_ns);
}

void HeartbeatMonitor::stopForSilence(SteadyTime now) {
  stop(now, "the player was silent for more than " +
                std::to_string(options_.longest_silence_ns / 1000000) + " ms in motion " +
                kAllowsMore);
}

void HeartbeatMonitor::end() {
  if (state_ == State::Watching) {
    state_ = State::Over;
  }
}

Outputs HeartbeatMonitor::step(SteadyTime now) {
  if (state_ == State::Watching && deadline() <= now) stopForSilence(now);
  if (state_ != State::Braking || now < next_brake_) {
    return {};
  }
  if (braking_end_ <= now) {
    state_ = State::Over;
  }
  next_brake_ = now.after(options_.braking_period_ns);
  return moving_;
}

SteadyTime HeartbeatMonitor::deadline() const {
  if (state_ == State::Braking) {
    return next_brake_;
  }
  return state_ == State::Over || moving_.empty() ? SteadyTime::forever()
                                                  : last_beat_.after(options_.longest_silence_ns);
}

}  // namespace replay
}  // namespace afterglow
