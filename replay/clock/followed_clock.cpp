#include "replay/clock/followed_clock.hpp"

namespace afterglow::replay {

void FollowedClock::tick(Stamp time) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (has_ticked_ && time > time_) now_.ns += time.ns - time_.ns;
    time_ = time;
    has_ticked_ = true;
  }
  changed_.notify_all();
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
