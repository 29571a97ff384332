#include "replay/store/sqlite/sqlite_recordings.hpp"

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

}  // namespace afterglow::replay
