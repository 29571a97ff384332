/// \file
/// The decisions of a player's watchdog: whether the player is alive, and what has to be brought to
/// rest if it is not. C++14, as afterglow_guard is built on robots with old systems, too.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "replay/clock/steady_time.hpp"

namespace afterglow {
namespace replay {

/// The help for a player that cannot help being late: the option, and the parameter of player_node.
constexpr const char* kAllowsMore = "(--longest-stall, ~longest_stall allows more)";

/// Outputs are known by number: who watches knows what stops each of them.
using Outputs = std::set<std::uint32_t>;

/// Fed with heartbeats and with the time (sinceBoot(); a test's will do). While nothing is in
/// motion, the player may be silent.
class HeartbeatMonitor {
 public:
  struct Options {
    std::int64_t longest_silence_ns = 60000000;
    std::int64_t braking_ns = 300000000;  ///< time of braking: a message may be lost
    std::int64_t braking_period_ns = 20000000;
  };
  explicit HeartbeatMonitor(const Options& options) : options_(options) {}

  /// Changes the longest silence from now on.
  void setLongestSilence(std::int64_t ns) { options_.longest_silence_ns = ns; }

  /// The player lives, and these of its outputs are in motion. `sent` is the player's own time:
  /// beats that it sent too far apart stop the robot, however close together they are heard, as
  /// player and watchdog may have slept or hung together. Too late while it brakes; a player that
  /// moves something after that is braked again.
  void beat(SteadyTime now, Outputs moving, SteadyTime sent);
  /// The player is gone, or asks for it: whatever is in motion has to stop.
  void stop(SteadyTime now, const std::string& reason);
  /// The player has ended, having stopped the robot itself.
  void end();

  /// Returns the outputs to be stopped now, each several times; empty: none. Called after each of
  /// these, and at deadline().
  Outputs step(SteadyTime now);
  SteadyTime deadline() const;
  bool isOver() const { return state_ == State::Over; }
  bool isMoving() const { return !moving_.empty(); }
  /// The reason why it brakes, or did; empty otherwise.
  const std::string& reason() const { return reason_; }

 private:
  enum class State { Watching, Braking, Over };

  void brake(SteadyTime now);
  void stopForSilence(SteadyTime now);

  Options options_;
  State state_ = State::Watching;
  Outputs moving_;
  SteadyTime last_beat_, last_sent_, next_brake_, braking_end_;
  std::string reason_;
};

}  // namespace replay
}  // namespace afterglow
