#include "replay/store/sqlite/store_stats.hpp"

#include <filesystem>

#include "replay/store/sqlite/recorder_lock.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"

namespace afterglow::replay {
namespace {

std::uint64_t fileSize(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

std::uint64_t number(SqliteConnection& connection, const std::string& sql) {
  return static_cast<std::uint64_t>(connection.integer(sql));
}

std::vector<StoreStats::Topic> topicStats(SqliteConnection& connection) {
  SqliteStatement query(connection,
                        "SELECT topic, type, sum(n), sum(total) FROM (SELECT channel, "
                        "count(*) AS n, sum(size) AS total FROM messages GROUP BY channel) "
                        "JOIN channels c ON c.id = channel JOIN definitions d ON d.id = definition "
                        "GROUP BY topic, type ORDER BY 4 DESC, topic");
  std::vector<StoreStats::Topic> topics;
  while (query.step()) {
    topics.push_back({query.text(0), query.text(1), static_cast<std::uint64_t>(query.integer(2)),
                      static_cast<std::uint64_t>(query.integer(3))});
  }
  return topics;
}

std::vector<StoreStats::Held> largestBehaviors(SqliteConnection& connection) {
  SqliteStatement query(
      connection,
      "SELECT b.id, name, begin_ns, count(*), sum(size) FROM behaviors b JOIN messages m "
      "ON m.recording = b.recording AND received_ns >= begin_ns "
      "AND received_ns < coalesce(end_ns, 9223372036854775807) "
      "GROUP BY b.id ORDER BY 5 DESC, b.id LIMIT 10");
  std::vector<StoreStats::Held> behaviors;
  while (query.step()) {
    behaviors.push_back({query.integer(0), query.text(1), Stamp{query.integer(2)},
                         static_cast<std::uint64_t>(query.integer(3)),
                         static_cast<std::uint64_t>(query.integer(4))});
  }
  return behaviors;
}

}  // namespace

StoreStats storeStats(const std::string& path) {
  const auto connection = openSqliteStore(path, OpenMode::ReadOnly);
  StoreStats stats;
  stats.file_bytes = fileSize(path) + fileSize(path + "-wal");
  stats.free_bytes =
      number(*connection, "PRAGMA freelist_count") * number(*connection, "PRAGMA page_size");
  stats.recordings = number(*connection, "SELECT count(*) FROM recordings");
  stats.behaviors = number(*connection, "SELECT count(*) FROM behaviors");
  stats.files = number(*connection, "SELECT count(*) FROM files");
  stats.topics = topicStats(*connection);
  for (const auto& topic : stats.topics) stats.messages += topic.messages;
  SqliteStatement span(*connection, "SELECT min(received_ns), max(received_ns) FROM messages");
  span.step();
  if (const auto first = span.optionalInteger(0)) stats.oldest = Stamp{*first};
  if (const auto last = span.optionalInteger(1)) stats.newest = Stamp{*last};
  stats.largest = largestBehaviors(*connection);
  stats.recorder = recorderOf(path);
  return stats;
}

}  // namespace afterglow::replay
