#include "replay/clock/followed_clock.hpp"

#include <algorithm>

namespace afterglow::replay {

std::int64_t FollowedClock::tick(Stamp time) {
  std::int64_t step_ns = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (has_ticked_) step_ns = time.ns - time_.ns;
    now_.ns += std::max<std::int64_t>(0, step_ns);
    time_ = time;
    has_ticked_ = true;
  }
  changed_.notify_all();
  return step_ns;
}

bool FollowedClock::hasTicked() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return has_ticked_;
}

Stamp FollowedClock::time() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return time_;
}

SteadyTime FollowedClock::now() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return now_;
}

bool FollowedClock::sleepUntil(SteadyTime deadline) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [&] { return is_woken_ || deadline <= now_; });
  if (is_woken_) {
    is_woken_ = false;
    return false;
  }
  return true;
}

void FollowedClock::wake() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_woken_ = true;
  }
  changed_.notify_all();
}

}  // namespace afterglow::replay
