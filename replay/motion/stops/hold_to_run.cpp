#include "replay/motion/stops/hold_to_run.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kFreshNs = 300'000'000;
constexpr std::int64_t kSteadyNs = 450'000'000;

}  // namespace

bool HoldToRun::isFresh(SteadyTime now) const { return now.ns - last_.ns <= kFreshNs; }

void HoldToRun::heard(SteadyTime now, bool is_pressed) {
  if (!is_pressed) {
    state_ = State::Released;
  } else if (state_ == State::Unknown) {
    state_ = State::Stuck;
  } else if (state_ == State::Released) {
    state_ = State::Held;
    since_ = now;
  } else if (state_ == State::Held && !isFresh(now)) {
    state_ = State::Silent;
  }
  last_ = now;
}

bool HoldToRun::isHeld(SteadyTime now) const { return state_ == State::Held && isFresh(now); }

bool HoldToRun::isHeldSteadily(SteadyTime now) const {
  return isHeld(now) && now.ns - since_.ns >= kSteadyNs;
}

bool HoldToRun::hasFallenSilent(SteadyTime now) const {
  return state_ == State::Silent || (state_ == State::Held && !isFresh(now));
}

}  // namespace afterglow::replay
