/// \file
/// What the watchdog beside a player decides: whether the player is alive, and what has to be
/// brought to rest if it is not.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "replay/clock/clock.hpp"

namespace afterglow::replay {

/// Outputs are known by number: who watches knows what stops each of them.
using Outputs = std::set<std::uint32_t>;

/// Fed with heartbeats and with the time; a test's clock will do. While nothing is in motion, the
/// player may be silent.
class HeartbeatWatch {
 public:
  struct Options {
    std::int64_t longest_silence_ns = 60'000'000;
    std::int64_t braking_ns = 300'000'000;  ///< one message may be lost, or overtaken
    std::int64_t braking_period_ns = 20'000'000;
  };
  explicit HeartbeatWatch(const Options& options) : options_(options) {}

  /// The player lives, and these of its outputs are in motion. Too late once braking has begun.
  void beat(SteadyTime now, Outputs moving);
  /// The player is gone, or asks for it: whatever is in motion has to stop.
  void stop(SteadyTime now, const std::string& reason);
  /// The player has ended, having stopped the robot itself.
  void end();

  /// To be called after each of these, and at deadline(). The outputs to be stopped now, each
  /// several times; empty: none.
  Outputs step(SteadyTime now);
  SteadyTime deadline() const;
  bool isOver() const { return state_ == State::Over; }
  /// Why it brakes, or did; empty otherwise.
  const std::string& reason() const { return reason_; }

 private:
  enum class State { Watching, Braking, Over };

  Options options_;
  State state_ = State::Watching;
  Outputs moving_;
  SteadyTime last_beat_, next_brake_, braking_end_;
  std::string reason_;
};

}  // namespace afterglow::replay
