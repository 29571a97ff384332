/// \file
/// The clocks that a player sleeps on. Injected: tests replay hours in no time.
///
/// Stamps of clocks that are not ours: another machine's, which may be ahead and drift, and wall
/// clocks, which are set while a robot drives.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "replay/clock/steady_time.hpp"
#include "replay/messages/message.hpp"

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

/// A clock on which the sleeping thread gives heartbeats: a player that hangs gives none. Sleeps on
/// another clock, which must outlive it. The other clock may stand still or run slowly, so tick()
/// says when a beat is due.
class BeatingClock : public Clock {
 public:
  BeatingClock(Clock& clock, std::function<void()> beat) : clock_(clock), beat_(std::move(beat)) {}

  SteadyTime now() const override { return clock_.now(); }
  bool sleepUntil(SteadyTime deadline) override;
  void wake() override;

  /// A beat is due: the sleeping thread gives it. Any thread.
  void tick();
  /// The calling thread gives the beats until another one sleeps.
  void watchThisThread() { sleeper_ = std::this_thread::get_id(); }
  /// Gives a beat that is due, if this is the thread that sleeps: to be called while it works.
  void beatIfDue();

 private:
  Clock& clock_;
  const std::function<void()> beat_;
  std::atomic<bool> is_due_{true}, is_woken_{false};
  std::atomic<std::thread::id> sleeper_{std::thread::id()};
};

/// A clock that another process drives: a simulation's /clock. It stands while that clock stands.
class FollowedClock : public Clock {
 public:
  /// Takes the other clock's time; any thread. Set back, it counts on from where it was. Returns
  /// how far that is from what it showed before, ns; 0 at first.
  std::int64_t tick(Stamp time);
  bool hasTicked() const;
  /// The last time of the other clock.
  Stamp time() const;

  SteadyTime now() const override;
  bool sleepUntil(SteadyTime deadline) override;
  void wake() override;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool has_ticked_ = false, is_woken_ = false;
  Stamp time_;
  SteadyTime now_{1'000'000'000};
};

/// Times at which a sender's messages were made, in the time in which they are received: the
/// shortest delay of late counts as none. No step of the sender's clock moves that by more than
/// messages are late.
class SenderClock {
 public:
  /// A message that was made at `stamp`, by its sender, came at `received`, by us, later than the
  /// one before. Empty: it is older than what came before it, and no news.
  std::optional<Stamp> heard(Stamp stamp, Stamp received);
  /// The number of messages whose stamps rose one after another, since the sender began, or its
  /// clock was set back; up to 2.
  int count() const { return count_; }

 private:
  Stamp stamp_, received_;  ///< stamps of the last message
  std::int64_t delay_ns_ = 0;
  int count_ = 0;
};

/// Notices that the wall clock is set, by a time that is not.
class ClockStepDetector {
 public:
  /// Returns true if it was set by more than 50 ms since the last call.
  bool hasStepped(Stamp wall, Stamp steady);

 private:
  std::optional<std::int64_t> apart_ns_;
};

}  // namespace afterglow::replay
