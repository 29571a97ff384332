/// \file
/// Counts of each behavior's messages on each channel, kept in a table so that listing behaviors
/// does not read messages. Internal to replay/store.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// Adds one batch of messages to the counts of the behaviors that cover them. Used within the
/// batch's transaction, under the lock of its connection.
class BatchCounts {
 public:
  /// No message of the batch lies outside of [first, last].
  BatchCounts(SqliteConnection& connection, Stamp first, Stamp last);
  void add(std::int64_t recording, std::int64_t channel, Stamp received);
  void write();

 private:
  struct Interval {
    std::int64_t behavior, begin_ns, end_ns;
  };
  struct Count {
    std::int64_t count = 0, first_ns = 0, last_ns = 0;
  };
  const std::vector<Interval>& intervals(std::int64_t recording);

  SqliteConnection& connection_;
  Stamp first_, last_;
  std::map<std::int64_t, std::vector<Interval>> intervals_;  ///< intervals by recording
  /// Additions by behavior and channel.
  std::map<std::pair<std::int64_t, std::int64_t>, Count> additions_;
};

/// Counts a behavior's messages anew: when it is new, and when its interval changes.
void countBehavior(SqliteConnection& connection, std::int64_t behavior);

/// Messages in a behavior's interval, by topic, then type: on the topics that the behavior names
/// (`own`), or on the others. Taken from the counts; a behavior that is not in the store with this
/// interval has its messages counted.
std::vector<TopicSummary> topicSummaries(SqliteConnection& connection, const Behavior& behavior,
                                         bool own);

}  // namespace afterglow::replay
