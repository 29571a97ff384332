/// \file
/// The clock that the player sleeps on. Injected: tests replay hours in no time.
#pragma once

#include "replay/clock/steady_time.hpp"

namespace afterglow::replay {

class Clock {
 public:
  virtual ~Clock() = default;
  virtual SteadyTime now() const = 0;
  /// Sleeps until the deadline; true if it came. False at once when wake() was called since the
  /// last sleep returned, or is called meanwhile. One thread sleeps.
  virtual bool sleepUntil(SteadyTime deadline) = 0;
  /// Any thread.
  virtual void wake() = 0;
};

/// CLOCK_MONOTONIC with absolute deadlines: neither steps of the wall clock nor slow callers make
/// it drift. A timerfd, because that can be woken at once; the kernel grants it no timer slack. The
/// last kSpin before a deadline is spent awake: a processor that sleeps needs up to 0.1 ms to wake.
class SteadyClock : public Clock {
 public:
  /// Throws std::system_error when the process has no file descriptors left.
  SteadyClock();
  ~SteadyClock() override;
  SteadyClock(const SteadyClock&) = delete;
  SteadyClock& operator=(const SteadyClock&) = delete;

  SteadyTime now() const override;
  bool sleepUntil(SteadyTime deadline) override;
  void wake() override;

 private:
  static constexpr std::int64_t kSpin = 200'000;  // ns
  int timer_ = -1, waker_ = -1;
};

}  // namespace afterglow::replay
