/// \file
/// A clock that jumps to whatever one sleeps for, so that hours are replayed in no time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <utility>

#include "replay/clock/clock.hpp"

namespace afterglow::replay {

/// Calls `at` hooks when their time passes, within sleepUntil. For one thread: hooks are where
/// other threads would act.
class JumpingClock : public Clock {
 public:
  SteadyTime now() const override { return now_; }
  bool sleepUntil(SteadyTime deadline) override {
    while (!is_woken_ && !hooks_.empty() && hooks_.begin()->first <= deadline.ns) {
      const auto node = hooks_.extract(hooks_.begin());
      now_.ns = std::max(now_.ns, node.key());
      node.mapped()();
    }
    if (std::exchange(is_woken_, false)) {
      return false;
    }
    if (deadline == SteadyTime::forever()) {
      throw std::logic_error("asleep for ever: no hook is left to wake this clock");
    }
    now_ = std::max(now_, deadline);
    return true;
  }
  void wake() override { is_woken_ = true; }

  void at(SteadyTime when, std::function<void()> hook) { hooks_.emplace(when.ns, std::move(hook)); }
  /// As if the process had been stopped for a while.
  void stall(std::int64_t nanoseconds) { now_.ns += nanoseconds; }

 private:
  SteadyTime now_{1'000'000'000};
  bool is_woken_ = false;
  std::multimap<std::int64_t, std::function<void()>> hooks_;
};

}  // namespace afterglow::replay
