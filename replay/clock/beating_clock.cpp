#include "replay/clock/beating_clock.hpp"

namespace afterglow::replay {

bool BeatingClock::sleepUntil(SteadyTime deadline) {
  watchThisThread();
  for (;;) {
    beatIfDue();
    if (clock_.sleepUntil(deadline)) {
      return true;
    }
    if (is_woken_.exchange(false)) {
      return false;
    }
  }
}

void BeatingClock::wake() {
  is_woken_ = true;
  clock_.wake();
}

void BeatingClock::tick() {
  is_due_ = true;
  clock_.wake();
}

void BeatingClock::beatIfDue() {
  if (sleeper_ == std::this_thread::get_id() && is_due_.exchange(false)) {
    beat_();
  }
}

}  // namespace afterglow::replay
