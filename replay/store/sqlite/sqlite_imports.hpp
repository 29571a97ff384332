/// \file
/// The imports into a SQLite store that are under way or broke off. Internal to replay/store.
#pragma once

#include <map>
#include <vector>

#include "replay/store/sqlite/sqlite_messages.hpp"
#include "replay/store/sqlite/store_files.hpp"

namespace afterglow::replay {

/// A row of the table `imports` for each recording that is being imported, and a lock for as long
/// as the program that imports it lives. Throws StoreError; all must outlive it.
class SqliteImports {
 public:
  /// `path`: of the store's file; empty for one in memory, whose imports need no locks.
  SqliteImports(SqliteConnection& connection, SqliteRecordings& recordings,
                SqliteMessages& messages, std::string path);

  /// Does what Store::beginImport() and so on do.
  std::int64_t begin(const Recording& recording);
  void finish(std::int64_t recording);
  void dropRecording(std::int64_t recording);
  std::size_t dropUnfinished();

 private:
  bool isUnfinished(std::int64_t recording) const;
  void requireNoBehaviors(std::int64_t recording) const;
  void removeRow(std::int64_t recording);
  bool isDead(std::int64_t recording) const;

  SqliteConnection& connection_;
  SqliteRecordings& recordings_;
  SqliteMessages& messages_;
  const std::string path_;
  std::map<std::int64_t, ImportLock> locks_;  ///< locks of this object's imports, by recording
};

/// Numbers of the recordings whose imports were begun and not finished, dead or alive.
std::vector<std::int64_t> unfinishedImports(SqliteConnection& connection);

}  // namespace afterglow::replay
