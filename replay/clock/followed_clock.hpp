/// \file
/// A clock that another process drives: a simulation's /clock. It stands while that clock stands.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>

#include "replay/clock/clock.hpp"
#include "replay/messages/message.hpp"

namespace afterglow::replay {

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

}  // namespace afterglow::replay
