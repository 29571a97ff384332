/// \file
/// Reads the behaviors of a SQLite store, also by the contents of their messages. Internal to
/// replay/store.
#pragma once

#include <string>
#include <vector>

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

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
