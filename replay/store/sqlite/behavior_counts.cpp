#include "replay/store/sqlite/behavior_counts.hpp"

#include <algorithm>

namespace afterglow::replay {

BatchCounts::BatchCounts(SqliteConnection& connection, Stamp first, Stamp last)
    : connection_(connection), first_(first), last_(last) {}

const std::vector<BatchCounts::Interval>& BatchCounts::intervals(std::int64_t recording) {
  const auto known = intervals_.find(recording);
  if (known != intervals_.end()) return known->second;
  SqliteStatement& query = connection_.prepared(
      "SELECT id, begin_ns, coalesce(end_ns, 9223372036854775807) FROM behaviors "
      "WHERE recording = ?1 AND begin_ns <= ?3 AND (end_ns IS NULL OR end_ns > ?2)");
  const StatementScope scope(query);
  query.bind(1, recording).bind(2, first_.ns).bind(3, last_.ns);
  std::vector<Interval> found;
  while (query.step()) found.push_back({query.integer(0), query.integer(1), query.integer(2)});
  return intervals_[recording] = std::move(found);
}

void BatchCounts::add(std::int64_t recording, std::int64_t channel, Stamp received) {
  for (const Interval& interval : intervals(recording)) {
    if (received.ns < interval.begin_ns || received.ns >= interval.end_ns) continue;
    Count& count = additions_[{interval.behavior, channel}];
    count.first_ns = count.count == 0 ? received.ns : std::min(count.first_ns, received.ns);
    count.last_ns = count.count == 0 ? received.ns : std::max(count.last_ns, received.ns);
    ++count.count;
  }
}

void BatchCounts::write() {
  SqliteStatement& update = connection_.prepared(
      "INSERT INTO behavior_counts VALUES (?1, ?2, ?3, ?4, ?5) ON CONFLICT DO UPDATE SET "
      "count = count + excluded.count, first_ns = min(first_ns, excluded.first_ns), "
      "last_ns = max(last_ns, excluded.last_ns)");
  for (const auto& [key, count] : additions_) {
    update.bind(1, key.first).bind(2, key.second).bind(3, count.count);
    update.bind(4, count.first_ns).bind(5, count.last_ns).run();
  }
}

void countBehavior(SqliteConnection& connection, std::int64_t behavior) {
  connection.prepared("DELETE FROM behavior_counts WHERE behavior = ?1").bind(1, behavior).run();
  connection
      .prepared(
          "INSERT INTO behavior_counts "
          "SELECT b.id, channel, count(*), min(received_ns), max(received_ns) FROM behaviors b "
          "JOIN messages m ON m.recording = b.recording AND received_ns >= begin_ns "
          "AND received_ns < coalesce(end_ns, 9223372036854775807) "
          "WHERE b.id = ?1 GROUP BY channel")
      .bind(1, behavior)
      .run();
}

}  // namespace afterglow::replay
