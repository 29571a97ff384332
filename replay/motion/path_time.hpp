/// \file
/// The progress of a replay along a recorded track, as a recorded stamp. It runs with the clock at
/// the pace it is given, a little faster while it is behind the replay's timeline, and never goes
/// back.
#pragma once

#include <optional>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

class PathTime {
 public:
  /// Throws std::invalid_argument for a rate that is not above zero.
  PathTime(Stamp begin, Stamp end, double rate);

  void advance(double seconds);

  Stamp now() const { return now_; }
  bool isAtEnd() const { return now_ >= end_; }
  /// Returns the stamp that it will have in so many seconds.
  Stamp in(double seconds) const;

  double rate() const { return rate_; }
  /// Sets the rate of recorded time to real time; the pace changes with it.
  void setRate(double rate);
  double pace() const { return pace_; }
  void setPace(double pace) { pace_ = pace; }

  /// Sets the stamp that it does not pass; at first there is no limit.
  void setLimit(Stamp limit) { limit_ = limit; }
  /// Takes the place of the replay's timeline; at first it is not known.
  void meet(Stamp recorded) { met_ = recorded; }

 private:
  Stamp now_;
  Stamp end_;
  std::optional<Stamp> limit_, met_;
  double rate_, pace_;
};

}  // namespace afterglow::replay
