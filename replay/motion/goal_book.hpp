/// \file
/// The book of open goals, and how goals ended.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/clock/clock.hpp"
#include "replay/messages/message.hpp"
#include "replay/motion/milestones.hpp"

namespace afterglow::replay {

/// The only book of open goals in a replay: of the player, of the way to the start, and of the
/// watchdog, which stops them. A goal is open from open() until it ends or its cancel is sent.
/// Recorded goals (add()) are waited for, counted, suspended and sent again; others only lead the
/// robot to the start or hold its gaze. Any thread.
class GoalBook {
 public:
  /// A goal is about to be sent; `topic` is the name it is published by.
  void open(const std::string& topic, const std::string& id);
  /// A goal's cancel is about to be sent, or was; an empty id cancels all goals of the topic.
  void cancel(const std::string& topic, const std::string& id);
  /// The goal is over, in whatever way.
  void close(const std::string& id);
  bool isOpen(const std::string& topic) const;
  /// A goal's final status was seen. Unknown ids are not ours: ignored. True if this ended an open
  /// recorded goal.
  bool finish(const std::string& id, GoalOutcome outcome, SteadyTime at,
              const std::string& how = "failed");
  /// The outcome, and how, as finish() was told; Open before.
  std::pair<GoalOutcome, std::string> endOf(const std::string& id) const;

  struct Entry {
    Channel channel;    ///< channel of the goal
    Bytes recorded;     ///< the goal's message, as it was recorded
    Stamp recorded_at;  ///< the recorded moment it was sent at
    std::string id;     ///< id that it was sent with
    /// The place of its end in the recording, if that is known and lies ahead.
    std::optional<Milestone> milestone = {};
    SteadyTime sent_at = {};
  };
  struct Ended : Entry {
    GoalOutcome outcome = GoalOutcome::Open;
    SteadyTime at;
    std::string how = {};  ///< GoalEnd::words()
  };

  // All below is about recorded goals.
  /// A recorded goal was sent; `topic` as for open().
  void add(const std::string& topic, Entry entry);
  /// The goals that ended since the last call.
  std::vector<Ended> takeEnded();
  /// The topic and the milestone of the open goal that is to end first in the recording, of those
  /// that are waited for.
  std::optional<std::pair<std::string, Milestone>> nextMilestone() const;
  /// Open goals whose milestones lie before this are not waited for any more.
  void giveUpWaiting(Stamp until);
  /// Gives up all open and suspended goals; those that were open have to be canceled.
  std::vector<Entry> giveUp();
  /// Sets the open goals aside, to be canceled, and gives them back, to be sent and added again.
  std::vector<Entry> suspendOpen();
  std::vector<Entry> takeSuspended();
  /// A goal that is in force at a moment the replay was moved to, to be sent when it goes on.
  void suspend(Entry entry);
  bool hasOpen() const;
  /// Returns the open goals of a recorded topic.
  std::vector<Entry> openOn(const std::string& recorded_topic) const;
  /// Returns the moment at which the first of the open goals was canceled that was canceled in the
  /// recording.
  std::optional<Stamp> nextCanceled() const;
  /// Gives up the open goals that were canceled in the recording until then, to be canceled.
  std::vector<Entry> giveUpCanceled(Stamp until);

  struct Counts {
    std::uint64_t sent = 0, succeeded = 0, failed = 0, canceled = 0;
  };
  Counts counts() const;

 private:
  struct Open {
    std::string topic, id;
    std::optional<Entry> recorded;
  };
  std::vector<Open>::iterator find(const std::string& id, const std::string& topic = {});
  std::vector<Entry> takeOpen(const std::function<bool(const Entry&)>& is_meant);

  mutable std::mutex mutex_;
  std::vector<Open> open_;
  std::vector<Entry> suspended_;
  std::vector<Ended> ended_;
  std::map<std::string, std::pair<GoalOutcome, std::string>> ends_;  ///< ends by id; and how
  Counts counts_;
};

/// The message that cancels one goal, to be published on cancelChannel(). Stamp zero and an id
/// cancel that goal only (actionlib's server, action_server_base.h).
Bytes cancelMessage(const std::string& goal_id);
/// "<action>/cancel" for "<action>/goal".
Channel cancelChannel(const Channel& goal_channel);

}  // namespace afterglow::replay
