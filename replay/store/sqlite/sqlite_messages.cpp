#include "replay/store/sqlite/sqlite_messages.hpp"

#include <algorithm>
#include <limits>

#include "replay/store/checksum.hpp"
#include "replay/store/sqlite/behavior_counts.hpp"
#include "replay/store/sqlite/sqlite_cursor.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"
#include "replay/store/store_import.hpp"

namespace afterglow::replay {

std::int64_t SqliteRecordings::add(const Recording& recording) {
  const SqliteLock lock = connection_.lock();
  SqliteTransaction transaction(connection_);
  const std::string key = recording.key.empty() ? newKey() : recording.key;
  SqliteStatement query(connection_, "SELECT id FROM recordings WHERE key = ?1");
  if (query.bind(1, key).step()) return query.integer(0);
  SqliteStatement insert(connection_,
                         "INSERT INTO recordings (key, source, robot) VALUES (?1, ?2, ?3)");
  insert.bind(1, key).bind(2, recording.source).bind(3, recording.robot).run();
  const std::int64_t id = connection_.lastInsertedId();
  transaction.commit();
  return id;
}

std::vector<Recording> SqliteRecordings::all() const {
  const SqliteLock lock = connection_.lock();
  SqliteStatement query(connection_, "SELECT id, key, source, robot FROM recordings ORDER BY id");
  std::vector<Recording> found;
  while (query.step()) {
    found.push_back({query.integer(0), query.text(1), query.text(2), query.text(3)});
  }
  return found;
}

void SqliteRecordings::require(std::int64_t recording) const {
  SqliteStatement query(connection_, "SELECT 1 FROM recordings WHERE id = ?1");
  if (query.bind(1, recording).step()) return;
  connection_.refuse("there is no recording " + std::to_string(recording));
}

bool SqliteRecordings::hasBehaviors(std::int64_t recording) const {
  SqliteStatement query(connection_, "SELECT 1 FROM behaviors WHERE recording = ?1");
  return query.bind(1, recording).step();
}

std::int64_t SqliteRecordings::definitionId(const Channel& channel) {
  SqliteStatement query(connection_,
                        "SELECT id FROM definitions WHERE md5 = ?1 AND type = ?2 AND text = ?3");
  query.bind(1, channel.md5).bind(2, channel.type).bind(3, channel.definition);
  if (query.step()) return query.integer(0);
  SqliteStatement insert(connection_,
                         "INSERT INTO definitions (md5, type, text) VALUES (?1, ?2, ?3)");
  insert.bind(1, channel.md5).bind(2, channel.type).bind(3, channel.definition).run();
  return connection_.lastInsertedId();
}

std::int64_t SqliteRecordings::addChannel(std::int64_t recording, const Channel& channel) {
  const SqliteLock lock = connection_.lock();
  SqliteTransaction transaction(connection_);
  require(recording);
  const std::int64_t definition = definitionId(channel);
  SqliteStatement query(connection_,
                        "SELECT id FROM channels WHERE recording = ?1 AND topic = ?2 AND "
                        "definition = ?3 AND latching = ?4 AND caller_id = ?5");
  SqliteStatement insert(connection_,
                         "INSERT INTO channels (recording, topic, definition, latching, caller_id) "
                         "VALUES (?1, ?2, ?3, ?4, ?5)");
  for (SqliteStatement* statement : {&query, &insert}) {
    statement->bind(1, recording).bind(2, channel.topic).bind(3, definition);
    statement->bind(4, std::int64_t{channel.latching}).bind(5, channel.caller_id);
  }
  std::int64_t id = 0;
  if (query.step()) {
    id = query.integer(0);
  } else {
    insert.run();
    id = connection_.lastInsertedId();
  }
  query.reset();
  transaction.commit();
  return id;
}

Channel SqliteRecordings::channel(std::int64_t id) const {
  const SqliteLock lock = connection_.lock();
  SqliteStatement query(connection_,
                        "SELECT topic, type, md5, text, latching, caller_id FROM channels "
                        "JOIN definitions ON definitions.id = definition WHERE channels.id = ?1");
  if (!query.bind(1, id).step()) connection_.refuse("there is no channel " + std::to_string(id));
  return {query.text(0), query.text(1),         query.text(2),
          query.text(3), query.integer(4) != 0, query.text(5)};
}

std::int64_t SqliteRecordings::ofChannel(std::int64_t channel) {
  const auto known = of_channel_.find(channel);
  if (known != of_channel_.end()) return known->second;
  SqliteStatement query(connection_, "SELECT recording FROM channels WHERE id = ?1");
  if (!query.bind(1, channel).step()) {
    connection_.refuse("there is no channel " + std::to_string(channel));
  }
  return of_channel_[channel] = query.integer(0);
}

void SqliteRecordings::remove(std::int64_t recording) {
  for (const char* sql :
       {"DELETE FROM channels WHERE recording = ?1", "DELETE FROM recordings WHERE id = ?1"}) {
    SqliteStatement(connection_, sql).bind(1, recording).run();
  }
  connection_.execute("DELETE FROM definitions WHERE id NOT IN (SELECT definition FROM channels)");
  forget();
}

namespace {

/// About as much as one transaction removes: a tenth of a second's work.
constexpr int kSliceMessages = 5000;
constexpr std::int64_t kSliceBytes = 32 << 20;

std::string insertSql(Duplicates duplicates) {
  return std::string(duplicates == Duplicates::Skip ? "INSERT OR IGNORE" : "INSERT") +
         " INTO messages (recording, channel, received_ns, sequence, header_stamp_ns, size, "
         "checksum, bytes) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)";
}

}  // namespace

SqliteMessages::SqliteMessages(SqliteConnection& connection, SqliteRecordings& recordings,
                               std::size_t largest)
    : connection_(connection), recordings_(recordings), largest_(largest) {}

void SqliteMessages::check(const std::vector<Message>& messages) const {
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const auto refuse = [&](const std::string& text) {
      throw MessageRefused(connection_.name() + ": " + text, i);
    };
    if (messages[i].bytes.size() > largest_) {
      refuse("a message of " + std::to_string(messages[i].bytes.size()) +
             " bytes is larger than a store can hold (" + std::to_string(largest_) + ")");
    }
    if (messages[i].sequence > std::numeric_limits<std::int64_t>::max()) {
      refuse("a sequence of " + std::to_string(messages[i].sequence) + " is too large");
    }
  }
}

void SqliteMessages::append(const std::vector<Message>& messages, Duplicates duplicates) {
  if (messages.empty()) return;
  check(messages);
  const auto [first, last] =
      std::minmax_element(messages.begin(), messages.end(),
                          [](const auto& a, const auto& b) { return a.received < b.received; });
  const SqliteLock lock = connection_.lock();
  SqliteTransaction transaction(connection_);
  BatchCounts counts(connection_, first->received, last->received);
  SqliteStatement& statement = connection_.prepared(insertSql(duplicates));
  for (const Message& message : messages) {
    const std::int64_t recording = recordings_.ofChannel(message.channel);
    if (!insert(statement, recording, message)) continue;
    counts.add(recording, message.channel, message.received);
  }
  counts.write();
  transaction.commit();
}

/// False: it was there.
bool SqliteMessages::insert(SqliteStatement& statement, std::int64_t recording,
                            const Message& message) {
  const Bytes& bytes = message.bytes;
  const bool is_chunked = bytes.size() > kSqliteChunkBytes;
  statement.bind(1, recording)
      .bind(2, message.channel)
      .bind(3, message.received.ns)
      .bind(4, static_cast<std::int64_t>(message.sequence))
      .bind(6, static_cast<std::int64_t>(bytes.size()))
      .bind(7, checksumOf(bytes.data(), bytes.size()));
  if (message.header_stamp) statement.bind(5, message.header_stamp->ns);
  if (!is_chunked) statement.bind(8, bytes);
  statement.run();
  const bool is_new = connection_.changedRows() > 0;
  if (is_new && is_chunked) insertChunks(connection_.lastInsertedId(), bytes);
  return is_new;
}

void SqliteMessages::insertChunks(std::int64_t message, const Bytes& bytes) {
  SqliteStatement& statement = connection_.prepared(
      "INSERT INTO chunks (message, number, checksum, bytes) VALUES (?1, ?2, ?3, ?4)");
  std::int64_t number = 0;
  for (std::size_t at = 0; at < bytes.size(); at += kSqliteChunkBytes, ++number) {
    const std::size_t size = std::min(kSqliteChunkBytes, bytes.size() - at);
    const std::uint8_t* chunk = bytes.data() + at;
    statement.bind(1, message).bind(2, number).bind(3, checksumOf(chunk, size));
    statement.bind(4, chunk, size).run();
  }
}

/// Returns where a slice of the interval ends that is not too large for one transaction.
std::int64_t SqliteMessages::sliceEnd(std::int64_t recording, Interval interval) const {
  SqliteStatement query(connection_,
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

void SqliteMessages::remove(std::int64_t recording, Interval interval, std::int64_t behavior) {
  for (WritingTurns turns; interval.begin_ns < interval.end_ns; turns.next()) {
    const SqliteLock lock = connection_.lock();
    SqliteTransaction transaction(connection_);
    const std::int64_t end_ns = sliceEnd(recording, interval);
    removeSlice(recording, {interval.begin_ns, end_ns}, behavior);
    transaction.commit();
    interval.begin_ns = end_ns;
  }
}

void SqliteMessages::removeSlice(std::int64_t recording, Interval slice, std::int64_t behavior) {
  SqliteStatement(connection_,
                  "UPDATE behavior_counts SET count = count - (SELECT count(*) FROM messages m "
                  "  WHERE m.recording = ?1 AND received_ns >= ?2 AND received_ns < ?3 "
                  "  AND m.channel = behavior_counts.channel) WHERE behavior = ?4")
      .bind(1, recording)
      .bind(2, slice.begin_ns)
      .bind(3, slice.end_ns)
      .bind(4, behavior)
      .run();
  for (const char* sql :
       {"DELETE FROM chunks WHERE message IN (SELECT message FROM chunks "
        "  JOIN messages m ON m.id = message WHERE m.recording = ?1 "
        "  AND received_ns >= ?2 AND received_ns < ?3)",
        "DELETE FROM messages WHERE recording = ?1 AND received_ns >= ?2 AND received_ns < ?3"}) {
    SqliteStatement(connection_, sql)
        .bind(1, recording)
        .bind(2, slice.begin_ns)
        .bind(3, slice.end_ns)
        .run();
  }
}

std::unique_ptr<MessageCursor> SqliteMessages::read(const Behavior& behavior,
                                                    const MessageRange& range) const {
  std::shared_ptr<const Condition> where;
  if (range.where) where = {range.where, &range.where->root()};
  return std::make_unique<SqliteCursor>(connection_, behavior, range, std::move(where));
}

}  // namespace afterglow::replay
