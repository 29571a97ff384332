/// \file
/// The behaviors of a SQLite store. Internal to replay/store.
#pragma once

#include <string>
#include <vector>

#include "replay/store/sqlite/sqlite_messages.hpp"

namespace afterglow::replay {

/// Throws StoreError; all must outlive it.
class SqliteBehaviors {
 public:
  /// `path`: of the store's file.
  SqliteBehaviors(SqliteConnection& connection, SqliteRecordings& recordings,
                  SqliteMessages& messages, std::string path, OpenMode mode);

  /// Does what Store::addBehavior() and so on do.
  std::int64_t add(const Behavior& behavior);
  void update(const Behavior& behavior);
  void remove(std::int64_t id);
  std::optional<Behavior> ofId(std::int64_t id) const;
  std::optional<Behavior> ofKey(const std::string& key) const;
  /// `steps`, if given, gets the lines of Store::explain().
  std::vector<Behavior> find(const BehaviorFilter& filter,
                             std::vector<std::string>* steps = nullptr) const;

  /// Ends the behaviors that a recorder which died left open. To be called by a recorder: it is the
  /// only one, and nobody else leaves behaviors open.
  void endAbandoned();

 private:
  std::vector<SqliteMessages::Interval> coveredOnlyBy(const Behavior& behavior) const;
  bool areOpenOnesAbandoned() const;
  std::optional<Behavior> first(SqliteStatement& query) const;

  SqliteConnection& connection_;
  SqliteRecordings& recordings_;
  SqliteMessages& messages_;
  const std::string path_;
  const OpenMode mode_;
};

}  // namespace afterglow::replay
