/// \file
/// The silence of a topic that is to be heard: one rule for an emergency stop, joint states,
/// odometry, localization and scans.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "replay/clock/steady_time.hpp"
#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// The bounds of a topic's silence, ns, whatever its period.
struct SilenceBounds {
  static constexpr std::int64_t kForEver = std::numeric_limits<std::int64_t>::max();

  /// A fast topic is not silent because a busy machine delivers it late.
  std::int64_t shortest = 200'000'000;
  std::int64_t longest = kForEver;  ///< also before the period is known
};
/// The bounds for topics that a motion relies on at every moment. A topic slower than 1 Hz does not
/// do.
inline constexpr SilenceBounds kMotionSilence{200'000'000, 1'000'000'000};
/// Controllers know where their joints are: what is told of them may be late on a busy machine.
inline constexpr SilenceBounds kJointSilence{1'000'000'000, 1'000'000'000};
/// Odometry bears a base for a while without localization.
inline constexpr SilenceBounds kLocalizationSilence{2'000'000'000, 5'000'000'000};

/// A topic that is sent periodically may miss four periods, as they are measured, within the
/// bounds. One that is sent on change has no period and may be silent for as long as they say. One
/// thread.
class SilenceMonitor {
 public:
  explicit SilenceMonitor(const SilenceBounds& bounds = {}) : bounds_(bounds) {}

  /// Takes a message by when it came, or by its own stamp; the same moment twice is one message. A
  /// clock that was set back begins anew.
  void heard(SteadyTime now);
  void heard(Stamp stamp) { heard(SteadyTime{stamp.ns}); }
  bool hasBeenHeard() const { return last_.has_value(); }
  bool knowsPeriod() const { return period_ns_.has_value(); }
  /// ns; none: it may be silent for ever, as far as is known.
  std::optional<std::int64_t> longestSilence() const;
  /// Returns true if it was heard once, and has been silent for longer than that.
  bool isOverdue(SteadyTime now) const;
  bool isOverdue(Stamp now) const { return isOverdue(SteadyTime{now.ns}); }
  /// s since it was heard last.
  double silence(Stamp now) const;

 private:
  static constexpr std::size_t kMostIntervals = 20;

  void measurePeriod();

  SilenceBounds bounds_;
  std::optional<SteadyTime> last_;
  std::array<std::int64_t, kMostIntervals> intervals_{};  ///< ns, the latest, in turn
  std::size_t count_ = 0;                                 ///< number of all intervals so far
  std::optional<std::int64_t> period_ns_;
};

}  // namespace afterglow::replay
