/// \file
/// The behaviors of a SQLite store, which are read also by the contents of their messages. Internal
/// to replay/store.
#pragma once

#include <string>
#include <vector>

#include "replay/store/sqlite/sqlite.hpp"
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

/// The SELECT whose rows readBehavior() reads; the table is `b` in the conditions.
std::string selectBehaviors(const std::string& conditions);

Behavior readBehavior(const SqliteStatement& row);

/// Does what Store::behaviors() does, but for `filter.where`, of which only equalities of a
/// behavior's own fields narrow the choice. `open_are_incomplete`: those without an end are given
/// out as kIncomplete. `steps`, if given, gets a line: index or all, and how many it looked at.
/// Under the lock of the connection.
std::vector<Behavior> findBehaviors(SqliteConnection& connection, const BehaviorFilter& filter,
                                    bool open_are_incomplete, std::vector<std::string>* steps);

/// Leaves those of `found` that match `filter.where`, `filter.limit` at most, in their order. Reads
/// through the connection, whose lock the caller holds; if that is null, through connections of its
/// own to the store in the file `path`. `steps`, if given, gets lines of Store::explain().
void filterBehaviors(SqliteConnection* connection, const std::string& path,
                     const BehaviorFilter& filter, std::vector<Behavior>& found,
                     std::vector<std::string>* steps);

}  // namespace afterglow::replay
