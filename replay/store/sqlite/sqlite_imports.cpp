#include "replay/store/sqlite/sqlite_imports.hpp"

#include <algorithm>
#include <limits>

namespace afterglow::replay {

SqliteImports::SqliteImports(SqliteConnection& connection, SqliteRecordings& recordings,
                             SqliteMessages& messages, std::string path)
    : connection_(connection),
      recordings_(recordings),
      messages_(messages),
      path_(std::move(path)) {}

std::int64_t SqliteImports::begin(const Recording& recording) {
  const SqliteLock lock = connection_.lock();
  SqliteTransaction transaction(connection_);
  connection_.execute("CREATE TABLE IF NOT EXISTS imports (recording INTEGER PRIMARY KEY)");
  Recording fresh = recording;
  fresh.key.clear();
  const std::int64_t id = recordings_.add(fresh);
  SqliteStatement(connection_, "INSERT INTO imports VALUES (?1)").bind(1, id).run();
  // Locked before another process can see the row without a lock, which would say that this one
  // has died.
  std::optional<ImportLock> import_lock;
  if (!path_.empty()) import_lock.emplace(path_, id);
  transaction.commit();
  if (import_lock) locks_.emplace(id, std::move(*import_lock));
  return id;
}

/// The lock stays: the transaction may be part of another, which is not committed yet.
void SqliteImports::finish(std::int64_t recording) {
  const SqliteLock lock = connection_.lock();
  SqliteTransaction transaction(connection_);
  if (!isUnfinished(recording)) {
    connection_.refuse("no import " + std::to_string(recording) + " is under way");
  }
  removeRow(recording);
  transaction.commit();
}

bool SqliteImports::isUnfinished(std::int64_t recording) const {
  const auto all = unfinishedImports(connection_);
  return std::find(all.begin(), all.end(), recording) != all.end();
}

void SqliteImports::removeRow(std::int64_t recording) {
  SqliteStatement(connection_, "DELETE FROM imports WHERE recording = ?1").bind(1, recording).run();
}

void SqliteImports::requireNoBehaviors(std::int64_t recording) const {
  if (!recordings_.hasBehaviors(recording)) return;
  connection_.refuse("recording " + std::to_string(recording) + " has behaviors");
}

std::size_t SqliteImports::dropUnfinished() {
  if (path_.empty()) return 0;
  SqliteLock lock = connection_.lock();
  const auto unfinished = unfinishedImports(connection_);
  lock.unlock();
  std::size_t dropped = 0;
  for (const std::int64_t recording : unfinished) {
    const auto import_lock = ImportLock::ofDead(path_, recording);
    if (!import_lock || !isDead(recording)) continue;
    dropRecording(recording);
    ++dropped;
  }
  return dropped;
}

/// Returns true if the import's lock is free. An import that was finished meanwhile has committed
/// before this transaction begins.
bool SqliteImports::isDead(std::int64_t recording) const {
  const SqliteLock lock = connection_.lock();
  SqliteTransaction transaction(connection_);
  const bool is_dead = isUnfinished(recording) && !recordings_.hasBehaviors(recording);
  transaction.commit();
  return is_dead;
}

void SqliteImports::dropRecording(std::int64_t recording) {
  SqliteLock lock = connection_.lock();
  requireNoBehaviors(recording);
  lock.unlock();
  messages_.remove(recording, {std::numeric_limits<std::int64_t>::min(), kEndOfTime.ns});
  lock.lock();
  SqliteTransaction transaction(connection_);
  requireNoBehaviors(recording);
  recordings_.remove(recording);
  if (isUnfinished(recording)) removeRow(recording);
  transaction.commit();
  locks_.erase(recording);
}

std::vector<std::int64_t> unfinishedImports(SqliteConnection& connection) {
  // The table is made by the first import.
  if (connection.integer("SELECT count(*) FROM sqlite_schema WHERE name = 'imports'") == 0) {
    return {};
  }
  SqliteStatement query(connection, "SELECT recording FROM imports ORDER BY recording");
  std::vector<std::int64_t> found;
  while (query.step()) found.push_back(query.integer(0));
  return found;
}

}  // namespace afterglow::replay
