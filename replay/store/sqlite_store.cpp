#include "replay/store/sqlite_store.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "replay/messages/document.hpp"
#include "replay/store/sqlite_cursor.hpp"
#include "replay/store/sqlite_schema.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kBehaviorColumns =
    "SELECT id, recording, name, tree_path, parent, attempt, outcome, begin_ns, end_ns, robot, "
    "parameters, tags, calibration, topics, key, wall_begin_ns, snapshot, remarks FROM behaviors "
    "b ";

std::string dump(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::vector<std::string> parseStrings(const std::string& array) {
  std::vector<std::string> strings;
  const auto json = nlohmann::json::parse(array, nullptr, false);
  for (const auto& element : json) {
    if (element.is_string()) strings.push_back(element.get<std::string>());
  }
  return strings;
}

bool isJsonObject(const std::string& text) {
  return nlohmann::json::parse(text, nullptr, false).is_object();
}

Behavior readBehavior(const SqliteStatement& row) {
  Behavior behavior;
  behavior.id = row.integer(0);
  behavior.recording = row.integer(1);
  behavior.name = row.text(2);
  behavior.tree_path = row.text(3);
  behavior.parent = row.integer(4);
  behavior.attempt = static_cast<int>(row.integer(5));
  behavior.outcome = row.text(6);
  behavior.begin = {row.integer(7)};
  if (const auto end_ns = row.optionalInteger(8)) behavior.end = Stamp{*end_ns};
  behavior.robot = row.text(9);
  behavior.parameters = row.text(10);
  behavior.tags = parseStrings(row.text(11));
  behavior.calibration = row.text(12);
  behavior.topics = parseStrings(row.text(13));
  behavior.key = row.text(14);
  behavior.wall_begin = {row.integer(15)};
  behavior.snapshot = row.text(16);
  behavior.remarks = parseStrings(row.text(17));
  return behavior;
}

/// Empty: the bytes do not fit the definition, or the document would be too long to be of use.
std::optional<std::string> documentOf(const Schema* schema, const Bytes& bytes,
                                      const SqliteLimits& limits) {
  if (!schema) return std::nullopt;
  try {
    std::string document = dump(toJson(decode(*schema, bytes), {limits.longest_array}));
    if (document.size() > limits.longest_document) return std::nullopt;
    return document;
  } catch (const MessageError&) {
    return std::nullopt;
  }
}

std::shared_ptr<const Schema> parseSchema(const std::string& type, const std::string& definition) {
  try {
    return std::make_shared<const Schema>(Schema::parse(type, definition));
  } catch (const MessageError&) {
    return nullptr;
  }
}

std::optional<std::int64_t> nanoseconds(const std::optional<Stamp>& stamp) {
  return stamp ? std::optional<std::int64_t>(stamp->ns) : std::nullopt;
}

}  // namespace

SqliteStore::SqliteStore(const std::string& path, OpenMode mode, const SqliteLimits& limits)
    : limits_(limits), connection_(openSqliteStore(path, mode)) {
  const std::string into =
      " INTO messages (recording, channel, received_ns, sequence, header_stamp_ns, document, "
      "bytes) "
      "VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";
  insert_message_ = std::make_unique<SqliteStatement>(*connection_, "INSERT" + into);
  insert_new_message_ = std::make_unique<SqliteStatement>(*connection_, "INSERT OR IGNORE" + into);
}

void SqliteStore::fail(const std::string& text) const {
  throw StoreError(connection_->name() + ": " + text);
}

// ---------------------------------------------------------------------------------------- writing

void SqliteStore::transaction(const std::function<void()>& work) {
  const Lock lock(mutex_);
  try {
    SqliteTransaction transaction(*connection_);
    work();
    transaction.commit();
  } catch (...) {
    channel_infos_.clear();  // ids that were given out in there will be given out again
    throw;
  }
}

std::int64_t SqliteStore::addRecording(const Recording& recording) {
  const Lock lock(mutex_);
  const std::string key = recording.key.empty() ? newKey() : recording.key;
  SqliteStatement query(*connection_, "SELECT id FROM recordings WHERE key = ?1");
  if (query.bind(1, key).step()) return query.integer(0);
  SqliteStatement insert(*connection_,
                         "INSERT INTO recordings (key, source, robot) VALUES (?1, ?2, ?3)");
  insert.bind(1, key).bind(2, recording.source).bind(3, recording.robot).run();
  return connection_->lastInsertedId();
}

void SqliteStore::requireRecording(std::int64_t id) {
  SqliteStatement query(*connection_, "SELECT 1 FROM recordings WHERE id = ?1");
  if (!query.bind(1, id).step()) fail("there is no recording " + std::to_string(id));
}

std::int64_t SqliteStore::definitionId(const Channel& channel) {
  SqliteStatement query(*connection_,
                        "SELECT id FROM definitions WHERE md5 = ?1 AND type = ?2 AND text = ?3");
  query.bind(1, channel.md5).bind(2, channel.type).bind(3, channel.definition);
  if (query.step()) return query.integer(0);
  SqliteStatement insert(*connection_,
                         "INSERT INTO definitions (md5, type, text) VALUES (?1, ?2, ?3)");
  insert.bind(1, channel.md5).bind(2, channel.type).bind(3, channel.definition).run();
  return connection_->lastInsertedId();
}

std::int64_t SqliteStore::addChannel(std::int64_t recording, const Channel& channel) {
  const Lock lock(mutex_);
  SqliteTransaction transaction(*connection_);
  requireRecording(recording);
  const std::int64_t definition = definitionId(channel);
  SqliteStatement query(*connection_,
                        "SELECT id FROM channels WHERE recording = ?1 AND topic = ?2 AND "
                        "definition = ?3 AND latching = ?4 AND caller_id = ?5");
  SqliteStatement insert(*connection_,
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
    id = connection_->lastInsertedId();
  }
  query.reset();
  transaction.commit();
  return id;
}

SqliteStore::ChannelInfo SqliteStore::channelInfo(std::int64_t channel) {
  const auto known = channel_infos_.find(channel);
  if (known != channel_infos_.end()) return known->second;
  SqliteStatement query(*connection_,
                        "SELECT recording, type, text FROM channels JOIN definitions "
                        "ON definitions.id = definition WHERE channels.id = ?1");
  if (!query.bind(1, channel).step()) fail("there is no channel " + std::to_string(channel));
  const ChannelInfo info{query.integer(0), parseSchema(query.text(1), query.text(2))};
  return channel_infos_[channel] = info;
}

std::vector<SqliteStore::ChannelInfo> SqliteStore::channelInfos(
    const std::vector<Message>& messages) {
  const Lock lock(mutex_);
  std::vector<ChannelInfo> infos;
  infos.reserve(messages.size());
  for (const Message& message : messages) infos.push_back(channelInfo(message.channel));
  return infos;
}

void SqliteStore::append(const std::vector<Message>& messages, Duplicates duplicates) {
  for (const Message& message : messages) {
    if (message.bytes.size() > limits_.largest_message) {
      fail("a message of " + std::to_string(message.bytes.size()) +
           " bytes is larger than a store can hold (" + std::to_string(limits_.largest_message) +
           ")");
    }
  }
  const std::vector<ChannelInfo> infos = channelInfos(messages);
  // Decoding is the longer half of the work and needs no lock.
  std::vector<std::optional<std::string>> documents;
  documents.reserve(messages.size());
  for (std::size_t i = 0; i < messages.size(); ++i) {
    documents.push_back(documentOf(infos[i].schema.get(), messages[i].bytes, limits_));
  }
  const Lock lock(mutex_);
  SqliteTransaction transaction(*connection_);
  SqliteStatement& statement =
      duplicates == Duplicates::Skip ? *insert_new_message_ : *insert_message_;
  for (std::size_t i = 0; i < messages.size(); ++i) {
    insert(statement, messages[i], infos[i], documents[i]);
  }
  transaction.commit();
}

void SqliteStore::insert(SqliteStatement& statement, const Message& message,
                         const ChannelInfo& info, const std::optional<std::string>& document) {
  if (message.sequence > std::numeric_limits<std::int64_t>::max()) {
    fail("a sequence of " + std::to_string(message.sequence) + " is too large");
  }
  statement.bind(1, info.recording)
      .bind(2, message.channel)
      .bind(3, message.received.ns)
      .bind(4, static_cast<std::int64_t>(message.sequence))
      .bind(5, nanoseconds(message.header_stamp))
      .bind(6, document)
      .bind(7, message.bytes)
      .run();
}

void SqliteStore::checkObjects(const Behavior& behavior) const {
  for (const auto& [what, text] : {std::pair("parameters", &behavior.parameters),
                                   std::pair("calibration", &behavior.calibration),
                                   std::pair("snapshot", &behavior.snapshot)}) {
    if (!isJsonObject(*text)) {
      fail(std::string(what) + " of behavior \"" + behavior.name + "\": no JSON object");
    }
  }
}

std::int64_t SqliteStore::addBehavior(const Behavior& behavior) {
  const Lock lock(mutex_);
  requireRecording(behavior.recording);
  SqliteTransaction transaction(*connection_);
  const std::string key = behavior.key.empty() ? newKey() : behavior.key;
  SqliteStatement insert(
      *connection_,
      "INSERT INTO behaviors (id, key, recording, name, tree_path, parent, "
      "attempt, outcome, begin_ns, wall_begin_ns, robot, parameters, tags, "
      "calibration, topics, snapshot, remarks) VALUES (?1, ?2, ?3, '', '', 0, 1, "
      "'', 0, 0, '', '', '', '', '', '', '')");
  insert.bind(1, behavior.id != 0 ? std::optional(behavior.id) : std::nullopt);
  insert.bind(2, key).bind(3, behavior.recording).run();
  Behavior stored = behavior;
  stored.id = connection_->lastInsertedId();
  updateBehavior(stored);
  transaction.commit();
  return stored.id;
}

void SqliteStore::updateBehavior(const Behavior& behavior) {
  const Lock lock(mutex_);
  checkObjects(behavior);
  const std::string tags = dump(behavior.tags);
  const std::string topics = dump(behavior.topics);
  const std::string remarks = dump(behavior.remarks);
  SqliteTransaction transaction(*connection_);
  if (!this->behavior(behavior.id)) fail("there is no behavior " + std::to_string(behavior.id));
  SqliteStatement update(*connection_,
                         "UPDATE behaviors SET name = ?2, tree_path = ?3, parent = ?4, "
                         "attempt = ?5, outcome = ?6, begin_ns = ?7, end_ns = ?8, robot = ?9, "
                         "parameters = ?10, tags = ?11, calibration = ?12, topics = ?13, "
                         "wall_begin_ns = ?14, snapshot = ?15, remarks = ?16 WHERE id = ?1");
  update.bind(1, behavior.id).bind(2, behavior.name).bind(3, behavior.tree_path);
  update.bind(4, behavior.parent).bind(5, std::int64_t{behavior.attempt});
  update.bind(6, behavior.outcome).bind(7, behavior.begin.ns).bind(8, nanoseconds(behavior.end));
  update.bind(9, behavior.robot).bind(10, behavior.parameters).bind(11, tags);
  update.bind(12, behavior.calibration).bind(13, topics).bind(14, behavior.wall_begin.ns);
  update.bind(15, behavior.snapshot).bind(16, remarks).run();
  transaction.commit();
}

void SqliteStore::removeBehavior(std::int64_t id) {
  const Lock lock(mutex_);
  SqliteTransaction transaction(*connection_);
  const std::optional<Behavior> removed = behavior(id);
  if (!removed) fail("there is no behavior " + std::to_string(id));
  SqliteStatement(*connection_, "DELETE FROM behaviors WHERE id = ?1").bind(1, id).run();
  SqliteStatement(*connection_, "UPDATE behaviors SET parent = ?2 WHERE parent = ?1")
      .bind(1, id)
      .bind(2, removed->parent)
      .run();
  SqliteStatement(*connection_,
                  "DELETE FROM messages WHERE recording = ?1 AND received_ns >= ?2 "
                  "AND received_ns < ?3 AND NOT EXISTS (SELECT 1 FROM behaviors b "
                  "  WHERE b.recording = ?1 AND b.begin_ns <= messages.received_ns "
                  "  AND (b.end_ns IS NULL OR messages.received_ns < b.end_ns))")
      .bind(1, removed->recording)
      .bind(2, removed->begin.ns)
      .bind(3, removed->end.value_or(Stamp{std::numeric_limits<std::int64_t>::max()}).ns)
      .run();
  transaction.commit();
}

void SqliteStore::addFile(const std::string& sha256, const Bytes& contents) {
  const Lock lock(mutex_);
  SqliteStatement(*connection_, "INSERT OR IGNORE INTO files (sha256, contents) VALUES (?1, ?2)")
      .bind(1, sha256)
      .bind(2, contents)
      .run();
}

// ---------------------------------------------------------------------------------------- reading

std::vector<Behavior> SqliteStore::behaviors(const BehaviorFilter& filter) const {
  const Lock lock(mutex_);
  SqliteStatement query(
      *connection_,
      std::string(kBehaviorColumns) +
          "WHERE (?1 IS NULL OR name = ?1) AND (?2 IS NULL OR outcome = ?2) "
          "AND (?3 IS NULL OR ?3 < coalesce(end_ns, (SELECT max(received_ns) + 1 FROM messages m "
          "  WHERE m.recording = b.recording), begin_ns + 1)) "
          "AND (?4 IS NULL OR begin_ns < ?4) "
          "AND (?5 IS NULL OR ?5 IN (SELECT value FROM json_each(b.topics)) AND EXISTS ("
          "  SELECT 1 FROM messages m WHERE m.recording = b.recording "
          "  AND received_ns >= begin_ns AND received_ns < coalesce(end_ns, ?6) "
          "  AND channel IN (SELECT id FROM channels c WHERE c.recording = b.recording "
          "                  AND c.topic = ?5))) "
          "ORDER BY begin_ns DESC, id DESC");
  query.bind(1, filter.name).bind(2, filter.outcome).bind(3, nanoseconds(filter.since));
  query.bind(4, nanoseconds(filter.until)).bind(5, filter.topic);
  query.bind(6, std::numeric_limits<std::int64_t>::max());
  std::vector<Behavior> found;
  while (query.step()) found.push_back(readBehavior(query));
  return found;
}

std::vector<std::string> SqliteStore::explain(const BehaviorFilter&) const { return {}; }

std::vector<Recording> SqliteStore::recordings() const {
  const Lock lock(mutex_);
  SqliteStatement query(*connection_, "SELECT id, key, source, robot FROM recordings ORDER BY id");
  std::vector<Recording> found;
  while (query.step()) {
    found.push_back({query.integer(0), query.text(1), query.text(2), query.text(3)});
  }
  return found;
}

std::optional<Behavior> SqliteStore::behaviorOfKey(const std::string& key) const {
  const Lock lock(mutex_);
  SqliteStatement query(*connection_, std::string(kBehaviorColumns) + "WHERE key = ?1");
  if (!query.bind(1, key).step()) return std::nullopt;
  return readBehavior(query);
}

std::optional<Bytes> SqliteStore::file(const std::string& sha256) const {
  const Lock lock(mutex_);
  SqliteStatement query(*connection_, "SELECT contents FROM files WHERE sha256 = ?1");
  if (!query.bind(1, sha256).step()) return std::nullopt;
  return query.bytes(0);
}

std::optional<Behavior> SqliteStore::behavior(std::int64_t id) const {
  const Lock lock(mutex_);
  SqliteStatement query(*connection_, std::string(kBehaviorColumns) + "WHERE id = ?1");
  if (!query.bind(1, id).step()) return std::nullopt;
  return readBehavior(query);
}

std::vector<TopicSummary> SqliteStore::topics(const Behavior& behavior) const {
  return summaries(behavior, true);
}

std::vector<TopicSummary> SqliteStore::contextTopics(const Behavior& behavior) const {
  return summaries(behavior, false);
}

std::vector<TopicSummary> SqliteStore::summaries(const Behavior& behavior, bool own) const {
  const Lock lock(mutex_);
  SqliteStatement query(
      *connection_,
      "SELECT topic, type, sum(count), min(first_ns), max(last_ns) FROM ("
      "  SELECT channel, count(*) AS count, min(received_ns) AS first_ns, "
      "  max(received_ns) AS last_ns FROM messages "
      "  WHERE recording = ?1 AND received_ns >= ?2 AND received_ns < ?3 GROUP BY channel) "
      "JOIN channels ON channels.id = channel JOIN definitions ON definitions.id = definition "
      "GROUP BY topic, type ORDER BY topic, type");
  query.bind(1, behavior.recording).bind(2, behavior.begin.ns);
  query.bind(3, behavior.end ? behavior.end->ns : std::numeric_limits<std::int64_t>::max());
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

Channel SqliteStore::channel(std::int64_t id) const {
  const Lock lock(mutex_);
  SqliteStatement query(*connection_,
                        "SELECT topic, type, md5, text, latching, caller_id FROM channels "
                        "JOIN definitions ON definitions.id = definition WHERE channels.id = ?1");
  if (!query.bind(1, id).step()) fail("there is no channel " + std::to_string(id));
  return {query.text(0), query.text(1),         query.text(2),
          query.text(3), query.integer(4) != 0, query.text(5)};
}

std::unique_ptr<MessageCursor> SqliteStore::messages(const Behavior& behavior,
                                                     const MessageRange& range) const {
  return std::make_unique<SqliteCursor>(*connection_, mutex_, behavior, range);
}

}  // namespace afterglow::replay
