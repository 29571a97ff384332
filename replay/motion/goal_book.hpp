/// \file
/// Which goals a replay has sent, and what became of them.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/clock/clock.hpp"
#include "replay/messages/message.hpp"
#include "replay/motion/milestones.hpp"

namespace afterglow::replay {

/// Any thread.
class GoalBook {
 public:
  struct Entry {
    Channel channel;    ///< of the goal
    Bytes recorded;     ///< the goal's message, as it was recorded
    Stamp recorded_at;  ///< the recorded moment it was sent at
    std::string id;     ///< it was sent with
    /// Where its end is in the recording, if that is known and lies ahead.
    std::optional<Milestone> milestone = {};
    SteadyTime sent_at = {};
  };
  struct Ended : Entry {
    GoalOutcome outcome = GoalOutcome::Open;
    SteadyTime at;
  };

  void add(Entry entry);
  /// Unknown ids are not ours: ignored. True if this ended an open goal.
  bool finish(const std::string& id, GoalOutcome outcome, SteadyTime at);
  /// What was finished since the last call.
  std::vector<Ended> takeEnded();
  /// The topic and the milestone of the open goal that is to end first in the recording, of those
  /// that are waited for.
  std::optional<std::pair<std::string, Milestone>> nextMilestone() const;
  /// Open goals whose milestones lie before this are not waited for any more.
  void giveUpWaiting(Stamp until);
  /// Gives up all open and suspended goals; those that were open have to be told so.
  std::vector<Entry> cancelOpen();
  /// Sets the open goals aside, to be told so, and gives them back, to be sent and added again.
  std::vector<Entry> suspendOpen();
  std::vector<Entry> takeSuspended();
  /// A goal that is in force at a moment the replay was moved to, to be sent when it goes on.
  void suspend(Entry entry);
  bool hasOpen() const;

  struct Counts {
    std::uint64_t sent = 0, succeeded = 0, failed = 0, canceled = 0;
  };
  Counts counts() const;

 private:
  mutable std::mutex mutex_;
  std::vector<Entry> open_, suspended_;
  std::vector<Ended> ended_;
  Counts counts_;
};

/// The message that cancels one goal, to be published on cancelChannel(). Stamp zero and an id
/// cancel that goal only (actionlib's server, action_server_base.h).
Bytes cancelMessage(const std::string& goal_id);
/// "<action>/cancel" for "<action>/goal".
Channel cancelChannel(const Channel& goal_channel);

}  // namespace afterglow::replay
