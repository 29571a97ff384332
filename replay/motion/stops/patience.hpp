/// \file
/// The patience of a player's watchdogs with its next heartbeat.
#pragma once

#include <cstdint>
#include <string>

#include "replay/clock/steady_time.hpp"

namespace afterglow::replay {

/// The time between two heartbeats of a player.
constexpr std::int64_t kBeatPeriod = 20'000'000;  // ns

/// The lateness with which this machine wakes a thread that wants to be woken at every beat:
/// measured before motion, as a machine that is late anyway must not be taken for a player that
/// hangs.
class BeatJitter {
 public:
  /// The thread was woken, and had asked for `wanted`.
  void add(SteadyTime wanted, SteadyTime woken);
  /// Returns true once the machine has been looked at for 0.3 s.
  bool isKnown() const;
  /// The longest of the last second, ns.
  std::int64_t lateness() const;

 private:
  static constexpr int kLooks = 50;  // a second of beats

  std::int64_t lateness_[kLooks] = {};
  int count_ = 0;
};

/// The lateness of a machine before motion.
struct MachineLateness {
  std::int64_t woken_ns = 0;  ///< BeatJitter::lateness()
  /// The part of the last minute, or of its last ten seconds if that is more, in which programs
  /// waited for a processor: a player that is punctual while it waits may wait for them later.
  double waiting = 0;
};
/// MachineLateness::waiting as the kernel tells it: the text of /proc/pressure/cpu; where that is
/// missing, the text of /proc/loadavg and the number of processors. 0 to 1; 0 if neither is told.
double waitingPart(const std::string& pressure, const std::string& load, unsigned processors);

/// Nobody waits longer for a player on the same machine, unless that is asked for: at 1 m/s it is
/// 0.15 m until the stop is sent.
constexpr std::int64_t kMostPatienceBeside = 150'000'000;  // ns
/// 60 ms on a machine that is on time and idle, more on one that is late or busy. ns.
std::int64_t patienceBeside(const MachineLateness& machine);
/// Returns why a machine would soon be taken for a player that hangs, and what helps; empty: it
/// would not.
std::string whyTooLate(const MachineLateness& machine);

/// Whatever is asked for, nothing moves longer without a sign of a player that is somewhere else.
constexpr std::int64_t kMostPatienceAfar = 1'000'000'000;  // ns

/// Returns the patience over a network, on a link on which beats got there at most so far apart. A
/// lost packet is sent again after 200 ms (the least of Linux), which must stop nothing: 300 ms at
/// least.
std::int64_t patienceAfar(std::int64_t longest_gap_ns);

}  // namespace afterglow::replay
