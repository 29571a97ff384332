/// \file
/// Stamps of clocks that are not ours: another machine's, which may be ahead and drift, and wall
/// clocks, which are set while a robot drives.
#pragma once

#include <cstdint>
#include <optional>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// Times at which a sender's messages were made, in the time in which they are received: the
/// shortest delay of late counts as none. No step of the sender's clock moves that by more than
/// messages are late.
class SenderClock {
 public:
  /// A message that was made at `stamp`, by its sender, came at `received`, by us, later than the
  /// one before. Empty: it is older than what came before it, and no news.
  std::optional<Stamp> heard(Stamp stamp, Stamp received);
  /// The number of messages whose stamps rose one after another, since the sender began, or its
  /// clock was set back; up to 2.
  int count() const { return count_; }

 private:
  Stamp stamp_, received_;  ///< stamps of the last message
  std::int64_t delay_ns_ = 0;
  int count_ = 0;
};

/// Notices that the wall clock is set, by a time that is not.
class ClockStepDetector {
 public:
  /// Returns true if it was set by more than 50 ms since the last call.
  bool hasStepped(Stamp wall, Stamp steady);

 private:
  std::optional<std::int64_t> apart_ns_;
};

}  // namespace afterglow::replay
