#include "replay/store/sqlite/sqlite_migration.hpp"

#include "replay/store/sqlite/sqlite_schema.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kSetAside = R"(
DROP INDEX definitions_by_md5;
DROP INDEX messages_in_order;
DROP INDEX behaviors_by_begin;
ALTER TABLE definitions RENAME TO old_definitions;
ALTER TABLE recordings RENAME TO old_recordings;
ALTER TABLE channels RENAME TO old_channels;
ALTER TABLE messages RENAME TO old_messages;
ALTER TABLE behaviors RENAME TO old_behaviors;
)";

/// A recording's robot is what its behaviors say. The wall clock at a behavior's begin was not
/// kept.
constexpr const char* kCopy = R"(
INSERT INTO definitions SELECT id, type, md5, text FROM old_definitions;
INSERT INTO recordings SELECT id, lower(hex(randomblob(16))), source,
  coalesce((SELECT max(robot) FROM old_behaviors b WHERE b.recording = r.id), '')
  FROM old_recordings r;
INSERT INTO channels SELECT id, recording, topic, definition, latching, caller_id
  FROM old_channels;
INSERT INTO behaviors SELECT id, lower(hex(randomblob(16))), recording, name, tree_path, parent,
  attempt, outcome, begin_ns, end_ns, 0, robot, parameters, tags, calibration, topics, '{}', '[]'
  FROM old_behaviors;
)";

constexpr const char* kDropOld = R"(
DROP TABLE old_behaviors;
DROP TABLE old_messages;
DROP TABLE old_channels;
DROP TABLE old_recordings;
DROP TABLE old_definitions;
)";

void copyMessages(SqliteConnection& connection) {
  const std::string chunk = std::to_string(kSqliteChunkBytes);
  connection.execute(
      "INSERT INTO messages SELECT id, recording, channel, received_ns, sequence, header_stamp_ns, "
      "length(bytes), checksum(bytes), iif(length(bytes) > " +
      chunk +
      ", NULL, bytes) "
      "FROM old_messages");
  connection.execute(
      "INSERT INTO chunks (message, number, checksum, bytes) "
      "WITH RECURSIVE piece (message, number) AS ("
      "  SELECT id, 0 FROM messages WHERE bytes IS NULL UNION ALL "
      "  SELECT message, number + 1 FROM piece "
      "  JOIN messages ON id = message WHERE (number + 1) * " +
      chunk +
      " < size) "
      "SELECT message, number, checksum(substr(bytes, number * " +
      chunk + " + 1, " + chunk +
      ")), "
      "substr(bytes, number * " +
      chunk + " + 1, " + chunk +
      ") "
      "FROM piece JOIN old_messages ON id = message");
}

}  // namespace

void migrateFromVersion1(SqliteConnection& connection) {
  connection.execute(kSetAside);
  makeSqliteTables(connection);
  connection.execute(kCopy);
  copyMessages(connection);
  connection.execute(
      "INSERT INTO behavior_counts SELECT b.id, channel, count(*), min(received_ns), "
      "max(received_ns) FROM behaviors b JOIN messages m ON m.recording = b.recording "
      "AND received_ns >= begin_ns AND received_ns < coalesce(end_ns, 9223372036854775807) "
      "GROUP BY b.id, channel");
  // What was not indexed is looked at.
  connection.execute(
      "INSERT INTO field_blocks SELECT id, -9223372036854775808, 0, 9223372036854775807, 0, x'', "
      "x'' FROM channels");
  connection.execute(kDropOld);
}

}  // namespace afterglow::replay
