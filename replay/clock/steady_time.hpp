/// \file
/// Steady time. C++14, as afterglow_guard is built on robots with old systems, too.
#pragma once

#include <time.h>

#include <cstdint>
#include <limits>

namespace afterglow {
namespace replay {

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

/// CLOCK_BOOTTIME: no step of the wall clock moves it, and it goes on while the machine sleeps,
/// which CLOCK_MONOTONIC does not. What watches over a player is counted in it.
inline SteadyTime sinceBoot() {
  timespec time{};
  clock_gettime(CLOCK_BOOTTIME, &time);
  return {static_cast<std::int64_t>(time.tv_sec) * 1000000000 + time.tv_nsec};
}

}  // namespace replay
}  // namespace afterglow
