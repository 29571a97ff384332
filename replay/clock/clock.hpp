/// \file
/// The clock the player sleeps on. Injected, so that tests replay hours in no time.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>

namespace afterglow::replay {

/// A point on the machine's monotonic clock, nanoseconds. Not ROS time, not comparable to a Stamp.
struct SteadyTime {
  std::int64_t ns = 0;

  /// Never comes.
  static constexpr SteadyTime forever() { return {std::numeric_limits<std::int64_t>::max()}; }
  constexpr SteadyTime after(std::int64_t nanoseconds) const { return {ns + nanoseconds}; }
  friend constexpr bool operator==(SteadyTime a, SteadyTime b) { return a.ns == b.ns; }
  friend constexpr bool operator<(SteadyTime a, SteadyTime b) { return a.ns < b.ns; }
  friend constexpr bool operator<=(SteadyTime a, SteadyTime b) { return a.ns <= b.ns; }
};

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
/// it drift. A timerfd, because that can be woken at once; the kernel grants it no timer slack.
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
  int timer_ = -1, waker_ = -1;
};

/// A clock that jumps to whatever one sleeps for. Calls `at` hooks when their time passes, within
/// sleepUntil. For one thread: hooks are where other threads would act.
class JumpingClock : public Clock {
 public:
  SteadyTime now() const override { return now_; }
  bool sleepUntil(SteadyTime deadline) override;
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
