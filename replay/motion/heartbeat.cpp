#include "replay/motion/heartbeat.hpp"

#include <utility>

namespace afterglow::replay {

void HeartbeatWatch::beat(SteadyTime now, Outputs moving) {
  if (state_ == State::Watching) {
    last_beat_ = now;
    moving_ = std::move(moving);
  }
}

void HeartbeatWatch::stop(SteadyTime now, const std::string& reason) {
  if (state_ != State::Watching) {
    return;
  }
  reason_ = reason;
  state_ = moving_.empty() ? State::Over : State::Braking;
  next_brake_ = now;
  braking_end_ = now.after(options_.braking_ns);
}

void HeartbeatWatch::end() {
  if (state_ == State::Watching) {
    state_ = State::Over;
  }
}

Outputs HeartbeatWatch::step(SteadyTime now) {
  if (state_ == State::Watching && deadline() <= now) {
    stop(now, "the player was silent for more than " +
                  std::to_string(options_.longest_silence_ns / 1'000'000) + " ms in motion");
  }
  if (state_ != State::Braking || now < next_brake_) {
    return {};
  }
  if (braking_end_ <= now) {
    state_ = State::Over;
  }
  next_brake_ = now.after(options_.braking_period_ns);
  return moving_;
}

SteadyTime HeartbeatWatch::deadline() const {
  if (state_ == State::Braking) {
    return next_brake_;
  }
  return state_ == State::Over || moving_.empty() ? SteadyTime::forever()
                                                  : last_beat_.after(options_.longest_silence_ns);
}

}  // namespace afterglow::replay
