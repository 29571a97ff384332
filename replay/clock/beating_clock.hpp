/// \file
/// A clock on which the sleeping thread gives heartbeats: a player that hangs gives no heartbeat.
#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <utility>

#include "replay/clock/clock.hpp"

namespace afterglow::replay {

/// Sleeps on another clock, which must outlive it. The other clock may stand still or run slowly,
/// so tick() says when a beat is due.
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

}  // namespace afterglow::replay
