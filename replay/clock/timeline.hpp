/// \file
/// The schedule of recorded moments on the steady clock. Three kinds of time, three types: Stamp
/// (ROS time of the recording), PlaybackTime (how far into the behavior), SteadyTime (now).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "replay/clock/clock.hpp"
#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// Nanoseconds of recorded time since the behavior's begin.
struct PlaybackTime {
  std::int64_t ns = 0;
  constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
};

/// Beyond these, a nanosecond or a century fits into no clock.
constexpr double kSlowestRate = 1e-3, kFastestRate = 1e3;
/// Returns why a replay cannot be so fast; empty: it can.
std::string whyNoRate(double rate);

/// An anchor {recorded, steady} and a rate. Pauses, moves and other rates move the anchor; nothing
/// is ever accumulated, so nothing drifts. At its limit the timeline stands still; when the limit
/// is lifted or moved on, it goes on from there. A value; not thread-safe.
class Timeline {
 public:
  /// `rate` recorded seconds pass a second. Throws std::logic_error for one beyond the bounds.
  Timeline(Stamp begin, double rate, SteadyTime start);

  /// Returns the time at which a recorded moment is due; SteadyTime::forever() while paused, and
  /// beyond the limit.
  SteadyTime deadline(Stamp recorded) const;
  /// Stands still before the anchor's moment has come.
  Stamp recorded(SteadyTime now) const;
  PlaybackTime position(SteadyTime now) const { return {recorded(now).ns - begin_.ns}; }

  bool isPaused() const { return is_paused_; }
  /// pause() does nothing while it is paused, resume() nothing while it runs.
  void pause(SteadyTime now);
  void resume(SteadyTime now);
  /// The last time; 0 before the first.
  SteadyTime pausedAt() const { return paused_at_; }
  SteadyTime resumedAt() const { return resumed_at_; }
  /// All pauses that are over, together.
  std::int64_t pausedNs() const { return paused_ns_; }
  double rate() const { return rate_; }
  /// Changes the rate from `now` on; the position stays. Throws as the constructor does.
  void setRate(double rate, SteadyTime now);
  /// The recorded moment is due at `when`, or when it is resumed. Limits are left as they are.
  void moveTo(Stamp recorded, SteadyTime when);

  /// The last recorded moment that the timeline comes to; empty: no limit. A limit that has passed
  /// holds the timeline where it is.
  void setLimit(std::optional<Stamp> limit, SteadyTime now);
  std::optional<Stamp> limit() const { return limit_; }
  /// Returns true while the timeline stands at its limit and is not paused.
  bool isHeld(SteadyTime now) const;

 private:
  Stamp begin_;
  double rate_;
  Stamp anchor_recorded_;
  SteadyTime anchor_steady_;
  bool is_paused_ = false;
  SteadyTime paused_at_, resumed_at_;
  std::int64_t paused_ns_ = 0;
  std::optional<Stamp> limit_;
};

}  // namespace afterglow::replay
