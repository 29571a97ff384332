#include "replay/store/sqlite/behavior_counts.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

/// A row for each topic and type; `counts` yields channel, count, first_ns and last_ns.
std::string byTopic(const std::string& counts) {
  return "SELECT topic, type, sum(count), min(first_ns), max(last_ns) FROM (" + counts +
         ") JOIN channels ON channels.id = channel JOIN definitions ON definitions.id = definition "
         "GROUP BY topic, type ORDER BY topic, type";
}

SqliteStatement& countsOf(SqliteConnection& connection, const Behavior& behavior) {
  SqliteStatement& known = connection.prepared(
      "SELECT 1 FROM behaviors WHERE id = ?1 AND recording = ?2 AND begin_ns = ?3 AND end_ns IS "
      "?4");
  const StatementScope scope(known);
  known.bind(1, behavior.id).bind(2, behavior.recording).bind(3, behavior.begin.ns);
  if (behavior.end) known.bind(4, behavior.end->ns);
  if (known.step()) {
    return connection.prepared(byTopic("SELECT * FROM behavior_counts WHERE behavior = ?1"))
        .bind(1, behavior.id);
  }
  return connection
      .prepared(byTopic("SELECT channel, count(*) AS count, min(received_ns) AS first_ns, "
                        "max(received_ns) AS last_ns FROM messages WHERE recording = ?1 "
                        "AND received_ns >= ?2 AND received_ns < ?3 GROUP BY channel"))
      .bind(1, behavior.recording)
      .bind(2, behavior.begin.ns)
      .bind(3, behavior.end ? behavior.end->ns : kEndOfTime.ns);
}

}  // namespace

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
      "INSERT INTO behavior_counts VALUES (?1, ?2, ?3, ?4, ?5) "
      "ON CONFLICT (behavior, channel) DO UPDATE SET "
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

std::vector<TopicSummary> topicSummaries(SqliteConnection& connection, const Behavior& behavior,
                                         bool own) {
  SqliteStatement& query = countsOf(connection, behavior);
  const StatementScope scope(query);
  std::vector<TopicSummary> found;
  while (query.step()) {
    TopicSummary summary{query.text(0), query.text(1), static_cast<std::uint64_t>(query.integer(2)),
                         Stamp{query.integer(3)}, Stamp{query.integer(4)}};
    const auto& names = behavior.topics;
    const bool is_own = std::find(names.begin(), names.end(), summary.topic) != names.end();
    if (is_own == own) found.push_back(std::move(summary));
  }
  return found;
}

}  // namespace afterglow::replay
