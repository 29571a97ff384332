// SqliteStore: messages go in and come out.
#include <algorithm>
#include <limits>

#include "replay/store/checksum.hpp"
#include "replay/store/sqlite/behavior_counts.hpp"
#include "replay/store/sqlite/sqlite_cursor.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"
#include "replay/store/sqlite/sqlite_store.hpp"
#include "replay/store/writing_turns.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kInsert =
    "INSERT INTO messages (recording, channel, received_ns, sequence, header_stamp_ns, size, "
    "checksum, bytes) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)";
constexpr const char* kInsertNew =
    "INSERT OR IGNORE INTO messages (recording, channel, received_ns, sequence, header_stamp_ns, "
    "size, checksum, bytes) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)";

/// What is removed in one transaction, about; a tenth of a second's work.
constexpr int kSliceMessages = 5000;
constexpr std::int64_t kSliceBytes = 32 << 20;

}  // namespace

void SqliteStore::checkMessages(const std::vector<Message>& messages) const {
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const auto refuse = [&](const std::string& text) {
      throw MessageRefused(connection_->name() + ": " + text, i);
    };
    if (messages[i].bytes.size() > limits_.largest_message) {
      refuse("a message of " + std::to_string(messages[i].bytes.size()) +
             " bytes is larger than a store can hold (" + std::to_string(limits_.largest_message) +
             ")");
    }
    if (messages[i].sequence > std::numeric_limits<std::int64_t>::max()) {
      refuse("a sequence of " + std::to_string(messages[i].sequence) + " is too large");
    }
  }
}

std::int64_t SqliteStore::recordingOf(std::int64_t channel) {
  const auto known = recordings_.find(channel);
  if (known != recordings_.end()) return known->second;
  SqliteStatement query(*connection_, "SELECT recording FROM channels WHERE id = ?1");
  if (!query.bind(1, channel).step()) fail("there is no channel " + std::to_string(channel));
  return recordings_[channel] = query.integer(0);
}

void SqliteStore::append(const std::vector<Message>& messages, Duplicates duplicates) {
  if (messages.empty()) return;
  checkMessages(messages);
  const auto [first, last] =
      std::minmax_element(messages.begin(), messages.end(),
                          [](const auto& a, const auto& b) { return a.received < b.received; });
  const Lock lock(mutex_);
  SqliteTransaction transaction(*connection_);
  BatchCounts counts(*connection_, first->received, last->received);
  SqliteStatement& statement =
      connection_->prepared(duplicates == Duplicates::Skip ? kInsertNew : kInsert);
  try {
    for (const Message& message : messages) {
      if (!insert(statement, message)) continue;
      const std::int64_t recording = recordingOf(message.channel);
      counts.add(recording, message.channel, message.received);
      field_index_->add(recording, message);
    }
    counts.write();
    transaction.commit();
  } catch (...) {
    field_index_->forget();
    throw;
  }
}

/// False: it was there.
bool SqliteStore::insert(SqliteStatement& statement, const Message& message) {
  const Bytes& bytes = message.bytes;
  const bool is_chunked = bytes.size() > kSqliteChunkBytes;
  statement.bind(1, recordingOf(message.channel))
      .bind(2, message.channel)
      .bind(3, message.received.ns)
      .bind(4, static_cast<std::int64_t>(message.sequence))
      .bind(6, static_cast<std::int64_t>(bytes.size()))
      .bind(7, checksumOf(bytes.data(), bytes.size()));
  if (message.header_stamp) statement.bind(5, message.header_stamp->ns);
  if (!is_chunked) statement.bind(8, bytes);
  statement.run();
  const bool is_new = connection_->changedRows() > 0;
  if (is_new && is_chunked) insertChunks(connection_->lastInsertedId(), bytes);
  return is_new;
}

void SqliteStore::insertChunks(std::int64_t message, const Bytes& bytes) {
  SqliteStatement& statement = connection_->prepared(
      "INSERT INTO chunks (message, number, checksum, bytes) VALUES (?1, ?2, ?3, ?4)");
  std::int64_t number = 0;
  for (std::size_t at = 0; at < bytes.size(); at += kSqliteChunkBytes, ++number) {
    const std::size_t size = std::min(kSqliteChunkBytes, bytes.size() - at);
    const std::uint8_t* chunk = bytes.data() + at;
    statement.bind(1, message).bind(2, number).bind(3, checksumOf(chunk, size));
    statement.bind(4, chunk, size).run();
  }
}

/// Where to stop, so that what is removed at once is not too much.
std::int64_t SqliteStore::sliceEnd(std::int64_t recording, Interval interval) const {
  SqliteStatement query(*connection_,
                        "SELECT received_ns, size FROM messages WHERE recording = ?1 "
                        "AND received_ns >= ?2 AND received_ns < ?3 ORDER BY received_ns");
  query.bind(1, recording).bind(2, interval.begin_ns).bind(3, interval.end_ns);
  std::int64_t bytes = 0;
  for (int messages = 0; query.step(); ++messages) {
    bytes += query.integer(1);
    if (messages >= kSliceMessages || bytes >= kSliceBytes) return query.integer(0) + 1;
  }
  return interval.end_ns;
}

void SqliteStore::removeMessages(const Behavior& behavior, Interval interval) {
  for (WritingTurns turns; interval.begin_ns < interval.end_ns; turns.next()) {
    const Lock lock(mutex_);
    SqliteTransaction transaction(*connection_);
    const std::int64_t end_ns = sliceEnd(behavior.recording, interval);
    for (const char* sql :
         {"UPDATE behavior_counts SET count = count - (SELECT count(*) FROM messages m "
          "  WHERE m.recording = ?1 AND received_ns >= ?2 AND received_ns < ?3 "
          "  AND m.channel = behavior_counts.channel) WHERE behavior = ?4",
          "DELETE FROM chunks WHERE message IN (SELECT message FROM chunks "
          "  JOIN messages m ON m.id = message WHERE m.recording = ?1 "
          "  AND received_ns >= ?2 AND received_ns < ?3 AND ?4)",
          "DELETE FROM messages WHERE recording = ?1 AND received_ns >= ?2 AND received_ns < ?3 "
          "AND ?4"}) {
      SqliteStatement statement(*connection_, sql);
      statement.bind(1, behavior.recording).bind(2, interval.begin_ns).bind(3, end_ns);
      statement.bind(4, behavior.id).run();
    }
    field_index_->remove(behavior.recording, interval.begin_ns, end_ns);
    transaction.commit();
    interval.begin_ns = end_ns;
  }
}

// ---------------------------------------------------------------------------------------- reading

std::vector<TopicSummary> SqliteStore::topics(const Behavior& behavior) const {
  return summaries(behavior, true);
}

std::vector<TopicSummary> SqliteStore::contextTopics(const Behavior& behavior) const {
  return summaries(behavior, false);
}

/// A row for each topic and type; from the counts, or from the messages where the behavior is not
/// one of the store's as it is.
SqliteStatement& SqliteStore::countsOf(const Behavior& behavior) const {
  SqliteStatement& known = connection_->prepared(
      "SELECT 1 FROM behaviors WHERE id = ?1 AND recording = ?2 AND begin_ns = ?3 AND end_ns IS "
      "?4");
  const StatementScope scope(known);
  known.bind(1, behavior.id).bind(2, behavior.recording).bind(3, behavior.begin.ns);
  if (behavior.end) known.bind(4, behavior.end->ns);
  if (known.step()) {
    return connection_
        ->prepared(
            "SELECT topic, type, sum(count), min(first_ns), max(last_ns) FROM behavior_counts "
            "JOIN channels ON channels.id = channel JOIN definitions ON definitions.id = "
            "definition "
            "WHERE behavior = ?1 GROUP BY topic, type ORDER BY topic, type")
        .bind(1, behavior.id);
  }
  return connection_
      ->prepared(
          "SELECT topic, type, sum(count), min(first_ns), max(last_ns) FROM ("
          "  SELECT channel, count(*) AS count, min(received_ns) AS first_ns, "
          "  max(received_ns) AS last_ns FROM messages "
          "  WHERE recording = ?1 AND received_ns >= ?2 AND received_ns < ?3 GROUP BY channel) "
          "JOIN channels ON channels.id = channel JOIN definitions ON definitions.id = definition "
          "GROUP BY topic, type ORDER BY topic, type")
      .bind(1, behavior.recording)
      .bind(2, behavior.begin.ns)
      .bind(3, behavior.end ? behavior.end->ns : std::numeric_limits<std::int64_t>::max());
}

std::vector<TopicSummary> SqliteStore::summaries(const Behavior& behavior, bool own) const {
  const Lock lock(mutex_);
  SqliteStatement& query = countsOf(behavior);
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

std::unique_ptr<MessageCursor> SqliteStore::messages(const Behavior& behavior,
                                                     const MessageRange& range) const {
  return std::make_unique<SqliteCursor>(*connection_, mutex_, *field_index_, behavior, range);
}

}  // namespace afterglow::replay
