#include "replay/store/sqlite/sqlite_store.hpp"

#include <algorithm>
#include <limits>

#include "replay/store/sqlite/sqlite_schema.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kInMemory = ":memory:";

}  // namespace

SqliteStore::SqliteStore(const std::string& path, OpenMode mode, const SqliteLimits& limits)
    : path_(path),
      mode_(mode),
      limits_(limits),
      connection_(openSqliteStore(path, mode)),
      field_index_(std::make_unique<SqliteFieldIndex>(*connection_)) {
  if (mode != OpenMode::ReadOnly) {
    connection_->foldLog(limits.fold_log_pages, limits.longest_log_pages);
  }
  if (mode != OpenMode::Record || path == kInMemory) return;
  recorder_lock_.emplace(path);
  endAbandonedBehaviors();
}

/// Blocks of the field index that are not ended would have to be looked at ever after.
SqliteStore::~SqliteStore() {
  if (!field_index_->hasOpenBlocks()) return;
  try {
    SqliteTransaction transaction(*connection_);
    field_index_->cutAll();
    transaction.commit();
  } catch (const std::exception&) {
    // Slower queries are all that is lost.
  }
}

void SqliteStore::fail(const std::string& text) const {
  throw StoreError(connection_->name() + ": " + text);
}

void SqliteStore::transaction(const std::function<void()>& work) {
  const Lock lock(mutex_);
  try {
    SqliteTransaction transaction(*connection_);
    work();
    transaction.commit();
  } catch (...) {
    recordings_.clear();  // ids that were given out in there will be given out again
    field_index_->forget();
    throw;
  }
}

void SqliteStore::compact() {
  const Lock lock(mutex_);
  if (path_ == kInMemory) return;
  if (const auto recorder = recorderOf(path_); recorder && mode_ != OpenMode::Record) {
    fail("cannot compact: " + *recorder + " records into it");
  }
  connection_->execute("VACUUM");
  connection_->execute("PRAGMA wal_checkpoint(TRUNCATE)");
}

std::optional<std::uint64_t> SqliteStore::usedBytes() const {
  const Lock lock(mutex_);
  return static_cast<std::uint64_t>(connection_->integer(
      "SELECT (page_count - freelist_count) * page_size FROM pragma_page_count(), "
      "pragma_freelist_count(), pragma_page_size()"));
}

// -------------------------------------------------------------------------------------- recordings

std::int64_t SqliteStore::addRecording(const Recording& recording) {
  const Lock lock(mutex_);
  SqliteTransaction transaction(*connection_);
  const std::string key = recording.key.empty() ? newKey() : recording.key;
  SqliteStatement query(*connection_, "SELECT id FROM recordings WHERE key = ?1");
  if (query.bind(1, key).step()) return query.integer(0);
  SqliteStatement insert(*connection_,
                         "INSERT INTO recordings (key, source, robot) VALUES (?1, ?2, ?3)");
  insert.bind(1, key).bind(2, recording.source).bind(3, recording.robot).run();
  const std::int64_t id = connection_->lastInsertedId();
  transaction.commit();
  return id;
}

void SqliteStore::requireRecording(std::int64_t id) {
  SqliteStatement query(*connection_, "SELECT 1 FROM recordings WHERE id = ?1");
  if (!query.bind(1, id).step()) fail("there is no recording " + std::to_string(id));
}

std::vector<Recording> SqliteStore::recordings() const {
  const Lock lock(mutex_);
  SqliteStatement query(*connection_, "SELECT id, key, source, robot FROM recordings ORDER BY id");
  std::vector<Recording> found;
  while (query.step()) {
    found.push_back({query.integer(0), query.text(1), query.text(2), query.text(3)});
  }
  return found;
}

// ----------------------------------------------------------------------------------------- imports

std::int64_t SqliteStore::beginImport(const Recording& recording) {
  const Lock lock(mutex_);
  SqliteTransaction transaction(*connection_);
  connection_->execute("CREATE TABLE IF NOT EXISTS imports (recording INTEGER PRIMARY KEY)");
  Recording fresh = recording;
  fresh.key.clear();
  const std::int64_t id = addRecording(fresh);
  SqliteStatement(*connection_, "INSERT INTO imports VALUES (?1)").bind(1, id).run();
  // Locked before anybody sees the row and could take it for a dead one's.
  std::optional<ImportLock> import_lock;
  if (path_ != kInMemory) import_lock.emplace(path_, id);
  transaction.commit();
  if (import_lock) import_locks_.emplace(id, std::move(*import_lock));
  return id;
}

/// The lock stays: the transaction may be part of another, which is not committed yet.
void SqliteStore::finishImport(std::int64_t recording) {
  const Lock lock(mutex_);
  SqliteTransaction transaction(*connection_);
  if (!isUnfinished(recording)) fail("no import " + std::to_string(recording) + " is under way");
  SqliteStatement(*connection_, "DELETE FROM imports WHERE recording = ?1")
      .bind(1, recording)
      .run();
  transaction.commit();
}

bool SqliteStore::isUnfinished(std::int64_t recording) {
  const auto all = unfinishedImports(*connection_);
  return std::find(all.begin(), all.end(), recording) != all.end();
}

std::size_t SqliteStore::dropUnfinished() {
  std::size_t dropped = 0;
  Lock lock(mutex_);
  const auto unfinished =
      path_ == kInMemory ? std::vector<std::int64_t>() : unfinishedImports(*connection_);
  lock.unlock();
  for (const std::int64_t recording : unfinished) {
    const auto import_lock = ImportLock::ofDead(path_, recording);
    if (!import_lock) continue;
    lock.lock();
    // One who finished it meanwhile has committed before this begins.
    SqliteTransaction transaction(*connection_);
    const bool is_dead = isUnfinished(recording) && !hasBehaviors(recording);
    transaction.commit();
    lock.unlock();
    if (!is_dead) continue;
    dropRecording(recording);
    ++dropped;
  }
  return dropped;
}

bool SqliteStore::hasBehaviors(std::int64_t recording) {
  SqliteStatement query(*connection_, "SELECT 1 FROM behaviors WHERE recording = ?1");
  return query.bind(1, recording).step();
}

void SqliteStore::dropRecording(std::int64_t recording) {
  Lock lock(mutex_);
  const auto requireNoBehaviors = [&] {
    if (hasBehaviors(recording)) fail("recording " + std::to_string(recording) + " has behaviors");
  };
  requireNoBehaviors();
  lock.unlock();
  Behavior all;  // of nobody: no behavior has this number
  all.id = -1;
  all.recording = recording;
  removeMessages(all, {std::numeric_limits<std::int64_t>::min(), kForEver_ns});
  lock.lock();
  SqliteTransaction transaction(*connection_);
  requireNoBehaviors();
  for (const char* sql :
       {"DELETE FROM field_blocks WHERE channel IN (SELECT id FROM channels WHERE recording = ?1)",
        "DELETE FROM channels WHERE recording = ?1", "DELETE FROM recordings WHERE id = ?1"}) {
    SqliteStatement(*connection_, sql).bind(1, recording).run();
  }
  connection_->execute("DELETE FROM definitions WHERE id NOT IN (SELECT definition FROM channels)");
  if (isUnfinished(recording)) {
    SqliteStatement(*connection_, "DELETE FROM imports WHERE recording = ?1")
        .bind(1, recording)
        .run();
  }
  transaction.commit();
  recordings_.clear();  // its numbers, and its channels', will be given out again
  field_index_->forget(recording);
  import_locks_.erase(recording);
}

// ---------------------------------------------------------------------------------------- channels

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

Channel SqliteStore::channel(std::int64_t id) const {
  const Lock lock(mutex_);
  SqliteStatement query(*connection_,
                        "SELECT topic, type, md5, text, latching, caller_id FROM channels "
                        "JOIN definitions ON definitions.id = definition WHERE channels.id = ?1");
  if (!query.bind(1, id).step()) fail("there is no channel " + std::to_string(id));
  return {query.text(0), query.text(1),         query.text(2),
          query.text(3), query.integer(4) != 0, query.text(5)};
}

// ------------------------------------------------------------------------------------------- files

void SqliteStore::addFile(const std::string& sha256, const Bytes& contents) {
  const Lock lock(mutex_);
  SqliteStatement(*connection_, "INSERT OR IGNORE INTO files (sha256, contents) VALUES (?1, ?2)")
      .bind(1, sha256)
      .bind(2, contents)
      .run();
}

std::optional<Bytes> SqliteStore::file(const std::string& sha256) const {
  const Lock lock(mutex_);
  SqliteStatement query(*connection_, "SELECT contents FROM files WHERE sha256 = ?1");
  if (!query.bind(1, sha256).step()) return std::nullopt;
  return query.bytes(0);
}

}  // namespace afterglow::replay
