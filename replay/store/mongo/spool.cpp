#include "replay/store/mongo/spool.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <random>

#include "replay/store/mongo/spool_entries.hpp"
#include "replay/store/private_files.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kSpoolVersion = 1;
/// Messages are gathered to entries of about this size; a larger message is an entry by itself.
constexpr std::size_t kEntryBytes = 16 << 20;
/// Ids from here on were given out without the server.
constexpr std::int64_t kOfflineIds = std::int64_t{1} << 40;

constexpr const char* kTables = R"(
CREATE TABLE outbox (id INTEGER PRIMARY KEY AUTOINCREMENT, kind INTEGER NOT NULL,
  messages INTEGER NOT NULL, payload BLOB NOT NULL);
CREATE TABLE recordings (id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, source TEXT NOT NULL,
  robot TEXT NOT NULL, last_ns INTEGER);
CREATE TABLE channels (id INTEGER PRIMARY KEY, recording INTEGER NOT NULL, topic TEXT NOT NULL,
  type TEXT NOT NULL, md5 TEXT NOT NULL, definition TEXT NOT NULL, latching INTEGER NOT NULL,
  caller_id TEXT NOT NULL);
CREATE INDEX channels_by_topic ON channels (recording, topic);
CREATE TABLE behaviors (id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE,
  is_open INTEGER NOT NULL, state BLOB NOT NULL);
CREATE TABLE ids (next INTEGER NOT NULL, last INTEGER NOT NULL);
INSERT INTO ids VALUES (1, 0);
)";

/// Not of version 1 from its beginning on; a program that does not know it leaves it alone.
constexpr const char* kRefused = R"(
CREATE TABLE IF NOT EXISTS refused (id INTEGER PRIMARY KEY, kind INTEGER NOT NULL,
  messages INTEGER NOT NULL, payload BLOB NOT NULL, why TEXT NOT NULL);
)";

/// Makes the spool's folder first.
RecorderLock lockSpool(const std::string& path) {
  try {
    makePrivateFolder(std::filesystem::path(path).parent_path());
  } catch (const StoreError& error) {
    throw StoreError("the spool " + path + ": " + error.what());
  }
  return RecorderLock(path);
}

std::unique_ptr<SqliteConnection> openSpool(const std::string& path) {
  auto connection = std::make_unique<SqliteConnection>(path, SqliteAccess::ReadWriteCreate);
  const std::int64_t version = connection->integer("PRAGMA user_version");
  if (version > kSpoolVersion) connection->refuse("a newer program's spool");
  if (version == 0) connection->execute("PRAGMA page_size = 16384");
  if (version == 0) connection->execute("PRAGMA auto_vacuum = INCREMENTAL");
  connection->execute("PRAGMA journal_mode = WAL");
  connection->execute("PRAGMA synchronous = FULL");
  connection->execute("PRAGMA wal_autocheckpoint = 4096");  // pages: 64 MiB
  connection->execute("PRAGMA journal_size_limit = 67108864");
  if (version == 0) {
    SqliteTransaction transaction(*connection);
    connection->execute(kTables);
    connection->execute("PRAGMA user_version = " + std::to_string(kSpoolVersion));
    transaction.commit();
  }
  connection->execute(kRefused);
  return connection;
}

}  // namespace

Spool::Spool(const std::string& path, std::uint64_t most_bytes)
    : most_bytes_(most_bytes),
      recorder_(lockSpool(path)),
      connection_(openSpool(path)),
      recordings_(*connection_) {
  unsent_.path = path;
  takeUpRefused();
  count();
  tidy();
  closeOpenBehaviors();
}

void Spool::count() {
  unsent_.unsent_messages = static_cast<std::uint64_t>(
      connection_->integer("SELECT coalesce(sum(messages), 0) FROM outbox"));
  unsent_.unsent_bytes = static_cast<std::uint64_t>(
      connection_->integer("SELECT coalesce(sum(length(payload)), 0) FROM outbox"));
}

/// What the server refused then it may take now. Its ids are older than those of the outbox: it is
/// sent first, in the order in which it was written.
void Spool::takeUpRefused() {
  SqliteTransaction transaction(*connection_);
  connection_->execute(
      "INSERT OR IGNORE INTO outbox SELECT id, kind, messages, payload FROM refused");
  connection_->execute("DELETE FROM refused");
  transaction.commit();
}

void Spool::setAside(const Entry& entry, std::uint64_t messages, const Bytes& payload,
                     const std::string& why) {
  const SqliteLock lock = connection_->lock();
  SqliteTransaction transaction(*connection_);
  SqliteStatement insert(*connection_,
                         "INSERT OR REPLACE INTO refused (id, kind, messages, payload, why) "
                         "VALUES (?1, ?2, ?3, ?4, ?5)");
  insert.bind(1, entry.id).bind(2, static_cast<std::int64_t>(entry.kind));
  insert.bind(3, static_cast<std::int64_t>(messages)).bind(4, payload);
  insert.bind(5, why).run();
  SqliteStatement(*connection_, "DELETE FROM outbox WHERE id = ?1").bind(1, entry.id).run();
  transaction.commit();
  unsent_.unsent_messages -= entry.messages;
  unsent_.unsent_bytes -= entry.payload.size();
  refused_bytes_ += payload.size();
  unsent_.refused_messages += messages;
  unsent_.refused_entries += 1;
  unsent_.last_refusal = why;
}

/// Forgets the rows that no entry of the outbox can name any more.
void Spool::tidy() {
  if (unsent_.unsent_bytes > 0) return;
  SqliteTransaction transaction(*connection_);
  connection_->execute("DELETE FROM behaviors WHERE is_open = 0");
  if (connection_->integer("SELECT count(*) FROM behaviors") == 0) {
    connection_->execute("DELETE FROM channels");
    connection_->execute("DELETE FROM recordings");
  }
  transaction.commit();
}

void Spool::closeOpenBehaviors() {
  std::vector<Behavior> open;
  SqliteStatement query(*connection_, "SELECT state FROM behaviors WHERE is_open = 1");
  while (query.step()) open.push_back(unpackBehavior(query.bytes(0)));
  SqliteTransaction transaction(*connection_);
  for (Behavior& behavior : open) {
    SqliteStatement last(*connection_, "SELECT last_ns FROM recordings WHERE id = ?1");
    const bool is_known = last.bind(1, behavior.recording).step();
    endIncomplete(behavior, is_known ? last.optionalInteger(0) : std::nullopt);
    putBehavior(behavior);
  }
  transaction.commit();
}

// ---------------------------------------------------------------------------------------- writing

void Spool::add(Kind kind, std::uint64_t messages, const Bytes& payload) {
  if (unsent_.unsent_bytes + refused_bytes_ + payload.size() > most_bytes_) {
    connection_->refuse("the spool is full: " + std::to_string(unsent_.unsent_bytes) +
                        " bytes wait for the server, at most " + std::to_string(most_bytes_) +
                        " may");
  }
  SqliteStatement insert(*connection_,
                         "INSERT INTO outbox (kind, messages, payload) VALUES (?1, ?2, ?3)");
  insert.bind(1, static_cast<std::int64_t>(kind)).bind(2, static_cast<std::int64_t>(messages));
  insert.bind(3, payload).run();
  unsent_.unsent_messages += messages;
  unsent_.unsent_bytes += payload.size();
}

void Spool::transaction(const std::function<void()>& work) {
  const SqliteLock lock = connection_->lock();
  try {
    SqliteTransaction transaction(*connection_);
    work();
    transaction.commit();
  } catch (...) {
    recordings_.forget();  // ids that were given out in there will be given out again
    if (!connection_->isInTransaction()) count();
    throw;
  }
}

std::int64_t Spool::addRecording(const Recording& recording) { return recordings_.add(recording); }

std::int64_t Spool::addChannel(std::int64_t recording, const Channel& channel) {
  const SqliteLock lock = connection_->lock();
  recordings_.require(recording);
  {
    SqliteStatement query(*connection_,
                          "SELECT id, type, md5, definition, latching, caller_id FROM channels "
                          "WHERE recording = ?1 AND topic = ?2");
    query.bind(1, recording).bind(2, channel.topic);
    while (query.step()) {
      const Channel known{channel.topic, query.text(1),         query.text(2),
                          query.text(3), query.integer(4) != 0, query.text(5)};
      if (known == channel) return query.integer(0);
    }
  }
  SqliteStatement insert(*connection_,
                         "INSERT INTO channels (recording, topic, type, md5, definition, latching, "
                         "caller_id) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)");
  insert.bind(1, recording).bind(2, channel.topic).bind(3, channel.type).bind(4, channel.md5);
  insert.bind(5, channel.definition).bind(6, std::int64_t{channel.latching});
  insert.bind(7, channel.caller_id).run();
  return connection_->lastInsertedId();
}

void Spool::append(const std::vector<Message>& messages) {
  std::map<std::int64_t, std::int64_t> last_ns;  // by channel
  for (const Message& message : messages) {
    const auto [at, is_new] = last_ns.emplace(message.channel, message.received.ns);
    at->second = std::max(at->second, message.received.ns);
  }
  transaction([&] {
    for (const auto& [channel, ns] : last_ns) {
      SqliteStatement(
          *connection_,
          "UPDATE recordings SET last_ns = max(coalesce(last_ns, ?2), ?2) WHERE id = ?1")
          .bind(1, recordingOf(channel))
          .bind(2, ns)
          .run();
    }
    std::size_t bytes = 0;
    for (std::size_t begin = 0, i = 0; i < messages.size(); ++i) {
      bytes += messages[i].bytes.size();
      if (bytes < kEntryBytes && i + 1 < messages.size()) continue;
      add(Kind::Messages, i + 1 - begin, packMessages(messages, begin, i + 1));
      begin = i + 1;
      bytes = 0;
    }
  });
}

void Spool::putBehavior(const Behavior& behavior) {
  transaction([&] {
    const Bytes state = packBehavior(behavior);
    if (!behavior.key.empty()) {
      SqliteStatement keep(*connection_,
                           "INSERT INTO behaviors (id, key, is_open, state) VALUES (?1, ?2, ?3, "
                           "?4) ON CONFLICT (id) DO UPDATE SET is_open = ?3, state = ?4");
      keep.bind(1, behavior.id).bind(2, behavior.key);
      keep.bind(3, std::int64_t{!behavior.end}).bind(4, state).run();
    }
    add(Kind::Behavior, 0, state);
  });
}

void Spool::removeBehavior(std::int64_t id) {
  transaction([&] {
    SqliteStatement(*connection_, "DELETE FROM behaviors WHERE id = ?1").bind(1, id).run();
    add(Kind::Removal, 0, packId(id));
  });
}

void Spool::addFile(const std::string& sha256, const Bytes& contents) {
  transaction([&] { add(Kind::File, 0, packFile(sha256, contents)); });
}

// ---------------------------------------------------------------------------------------- reading

Recording Spool::recording(std::int64_t id) const {
  const SqliteLock lock = connection_->lock();
  SqliteStatement query(*connection_, "SELECT key, source, robot FROM recordings WHERE id = ?1");
  if (!query.bind(1, id).step()) {
    connection_->refuse("there is no recording " + std::to_string(id));
  }
  return {id, query.text(0), query.text(1), query.text(2)};
}

std::int64_t Spool::recordingOf(std::int64_t channel) {
  const SqliteLock lock = connection_->lock();
  return recordings_.ofChannel(channel);
}

Channel Spool::channel(std::int64_t id) const {
  const SqliteLock lock = connection_->lock();
  SqliteStatement query(*connection_,
                        "SELECT topic, type, md5, definition, latching, caller_id FROM channels "
                        "WHERE id = ?1");
  if (!query.bind(1, id).step()) connection_->refuse("there is no channel " + std::to_string(id));
  return {query.text(0), query.text(1),         query.text(2),
          query.text(3), query.integer(4) != 0, query.text(5)};
}

std::optional<Behavior> Spool::behavior(std::int64_t id) const {
  const SqliteLock lock = connection_->lock();
  SqliteStatement query(*connection_, "SELECT state FROM behaviors WHERE id = ?1");
  if (!query.bind(1, id).step()) return std::nullopt;
  return unpackBehavior(query.bytes(0));
}

std::optional<Behavior> Spool::behaviorOfKey(const std::string& key) const {
  const SqliteLock lock = connection_->lock();
  SqliteStatement query(*connection_, "SELECT state FROM behaviors WHERE key = ?1");
  if (!query.bind(1, key).step()) return std::nullopt;
  return unpackBehavior(query.bytes(0));
}

std::int64_t Spool::takeBehaviorId() {
  const SqliteLock lock = connection_->lock();
  if (idsLeft() > 0) {
    connection_->execute("UPDATE ids SET next = next + 1");
    return connection_->integer("SELECT next - 1 FROM ids");
  }
  std::random_device random;
  const std::uint64_t drawn = (std::uint64_t{random()} << 32 | random()) >> 12;
  return kOfflineIds + static_cast<std::int64_t>(drawn);
}

std::int64_t Spool::idsLeft() const {
  const SqliteLock lock = connection_->lock();
  return connection_->integer("SELECT last - next + 1 FROM ids");
}

void Spool::giveIds(std::int64_t first, std::int64_t count) {
  const SqliteLock lock = connection_->lock();
  SqliteStatement(*connection_, "UPDATE ids SET next = ?1, last = ?2")
      .bind(1, first)
      .bind(2, first + count - 1)
      .run();
}

std::vector<Spool::Entry> Spool::front(std::size_t bytes) const {
  const SqliteLock lock = connection_->lock();
  SqliteStatement query(*connection_, "SELECT id, kind, messages, payload FROM outbox ORDER BY id");
  std::vector<Entry> entries;
  std::size_t taken = 0;
  while (taken < bytes && query.step()) {
    const auto kind = static_cast<Kind>(query.integer(1));
    const bool is_first = entries.empty();
    if (!is_first && (kind != Kind::Messages || entries.back().kind != kind)) break;
    entries.push_back(
        {query.integer(0), kind, static_cast<std::uint64_t>(query.integer(2)), query.bytes(3)});
    taken += entries.back().payload.size();
  }
  return entries;
}

void Spool::confirm(const std::vector<Entry>& entries) {
  const SqliteLock lock = connection_->lock();
  SqliteStatement(*connection_, "DELETE FROM outbox WHERE id <= ?1")
      .bind(1, entries.back().id)
      .run();
  for (const Entry& entry : entries) {
    unsent_.unsent_messages -= entry.messages;
    unsent_.unsent_bytes -= entry.payload.size();
  }
  // The file shrinks when all is sent; until then its pages are used again.
  if (unsent_.unsent_bytes == 0) connection_->execute("PRAGMA incremental_vacuum");
}

SpoolStatus Spool::unsent() const {
  const SqliteLock lock = connection_->lock();
  return unsent_;
}

}  // namespace afterglow::replay
