#include "replay/store/sqlite/sqlite_store.hpp"

#include <filesystem>

#include "replay/store/sqlite/behavior_counts.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"

namespace afterglow::replay {

SqliteStore::SqliteStore(const std::string& path, OpenMode mode, const SqliteLimits& limits)
    : path_(path == ":memory:" ? "" : path),
      mode_(mode),
      connection_(openSqliteStore(path, mode)),
      recordings_(*connection_),
      messages_(*connection_, recordings_, limits.largest_message),
      imports_(*connection_, recordings_, messages_, path_),
      behaviors_(*connection_, recordings_, messages_, path_, mode) {
  if (mode != OpenMode::ReadOnly) {
    connection_->foldLog(limits.fold_log_pages, limits.longest_log_pages);
  }
  if (mode != OpenMode::Record || path_.empty()) return;
  recorder_lock_.emplace(path);
  behaviors_.endAbandoned();
}

void SqliteStore::transaction(const std::function<void()>& work) {
  const SqliteLock lock = connection_->lock();
  try {
    SqliteTransaction transaction(*connection_);
    work();
    transaction.commit();
  } catch (...) {
    recordings_.forget();
    throw;
  }
}

void SqliteStore::compact() {
  const SqliteLock lock = connection_->lock();
  if (path_.empty()) return;
  if (const auto recorder = recorderOf(path_); recorder && mode_ != OpenMode::Record) {
    connection_->refuse("cannot compact: " + *recorder + " records into it");
  }
  connection_->execute("VACUUM");
  connection_->execute("PRAGMA wal_checkpoint(TRUNCATE)");
}

std::string SqliteStore::folder() const {
  return path_.empty() ? "" : std::filesystem::absolute(path_).parent_path();
}

std::optional<std::uint64_t> SqliteStore::usedBytes() const {
  const SqliteLock lock = connection_->lock();
  return static_cast<std::uint64_t>(connection_->integer(
      "SELECT (page_count - freelist_count) * page_size FROM pragma_page_count(), "
      "pragma_freelist_count(), pragma_page_size()"));
}

std::vector<std::string> SqliteStore::explain(const BehaviorFilter& filter) const {
  std::vector<std::string> steps;
  behaviors_.find(filter, &steps);
  return steps;
}

std::vector<TopicSummary> SqliteStore::topics(const Behavior& behavior) const {
  const SqliteLock lock = connection_->lock();
  return topicSummaries(*connection_, behavior, true);
}

std::vector<TopicSummary> SqliteStore::contextTopics(const Behavior& behavior) const {
  const SqliteLock lock = connection_->lock();
  return topicSummaries(*connection_, behavior, false);
}

void SqliteStore::addFile(const std::string& sha256, const Bytes& contents) {
  const SqliteLock lock = connection_->lock();
  SqliteStatement(*connection_, "INSERT OR IGNORE INTO files (sha256, contents) VALUES (?1, ?2)")
      .bind(1, sha256)
      .bind(2, contents)
      .run();
}

std::optional<Bytes> SqliteStore::file(const std::string& sha256) const {
  const SqliteLock lock = connection_->lock();
  SqliteStatement query(*connection_, "SELECT contents FROM files WHERE sha256 = ?1");
  if (!query.bind(1, sha256).step()) return std::nullopt;
  return query.bytes(0);
}

}  // namespace afterglow::replay
