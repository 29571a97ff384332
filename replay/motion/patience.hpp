/// \file
/// How long the watchdogs of a player wait for its next heartbeat.
#pragma once

#include <cstdint>

#include "replay/clock/steady_time.hpp"

namespace afterglow::replay {

/// How often a player shows that it lives.
constexpr std::int64_t kBeatPeriod = 20'000'000;  // ns

/// How late this machine wakes a thread that wants to be woken at every beat: measured before
/// motion, as a machine that is late anyway must not be taken for a player that hangs.
class BeatJitter {
 public:
  /// The thread was woken, and had asked for `wanted`.
  void add(SteadyTime wanted, SteadyTime woken);
  /// It has been looked at for 0.3 s.
  bool isKnown() const;
  /// The longest of the last second, ns.
  std::int64_t lateness() const;

 private:
  static constexpr int kLooks = 50;  // a second of beats

  std::int64_t lateness_[kLooks] = {};
  int count_ = 0;
};

/// 60 ms on a machine that is on time, more on one that is late, 150 ms at most. ns.
std::int64_t patienceBeside(std::int64_t lateness_ns);

/// Whatever is asked for, nothing moves longer without a sign of a player that is somewhere else.
constexpr std::int64_t kMostPatienceAfar = 1'000'000'000;  // ns

/// Over a network: of a link on which beats got there at most so far apart. A lost packet is sent
/// again after 200 ms (the least of Linux), which must stop nothing: 300 ms at least.
std::int64_t patienceAfar(std::int64_t longest_gap_ns);

}  // namespace afterglow::replay
