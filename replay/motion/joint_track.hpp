/// \file
/// A robot's joints by its joint states, in the recording's time. Radians and meters.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// The behavior with what its recording has around two moments: joint states come many times a
/// second, transforms too; what is older by 5 s may not be so any more.
Behavior aroundMoments(const Behavior& behavior, Stamp from, Stamp to);

/// A value; joint states that come faster than every 10 ms are thinned.
class JointTrack {
 public:
  /// The sensor_msgs/JointState of a behavior and of what was recorded beside it, from 5 s before
  /// `from` to 1 s after `to`. Messages that cannot be understood are left out. Throws StoreError.
  static JointTrack read(const Store& store, const Behavior& behavior, Stamp from, Stamp to);

  /// Adds a position; `at`: when it was heard of. Positions that are no numbers are left out.
  void add(const std::string& joint, Stamp at, double position);

  /// The last position of every joint until then, or else its first after it; the first after it,
  /// too, where that is nearer and the last is older than a second: it is of an earlier recording.
  std::map<std::string, double> at(Stamp moment) const;

  std::vector<std::string> names() const;
  /// The fastest that a joint was in [from, to], over a quarter of a second; 0 if it was not heard
  /// of.
  double fastest(const std::string& joint, Stamp from, Stamp to) const;

  /// Joint states are told, recorded and replayed with delays: where a joint was around a moment
  /// counts as where it was at it.
  static constexpr std::int64_t kAroundNs = 250'000'000;
  struct Reach {
    double at = 0;               ///< position at the moment, between the samples around it
    double least = 0, most = 0;  ///< around the moment

    /// Returns how far a position lies outside, which is so far from `at`; 0: it lies within.
    double off(double way) const { return std::max({0., way - (most - at), least - at - way}); }
  };
  /// Returns the reach of a joint from `margin_ns` before a moment to as much after it. Empty if it
  /// was not heard of within a second of the moment.
  std::optional<Reach> around(const std::string& joint, Stamp moment, std::int64_t margin_ns) const;

 private:
  struct Sample {
    Stamp at;
    double position;
  };
  std::map<std::string, std::vector<Sample>> joints_;
};

}  // namespace afterglow::replay
