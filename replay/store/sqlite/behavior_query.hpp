/// \file
/// Reads the behaviors of a SQLite store. Internal to replay/store.
#pragma once

#include <string>
#include <vector>

#include "replay/store/sqlite/sqlite_field_index.hpp"

namespace afterglow::replay {

/// The SELECT whose rows readBehavior() reads; the table is `b` in the conditions.
std::string selectBehaviors(const std::string& conditions);

Behavior readBehavior(const SqliteStatement& row);

/// As Store::behaviors(): the indexes of the tables and of the messages' fields narrow the choice,
/// the filter decides. `open_are_incomplete`: those without an end are given out as kIncomplete.
/// `steps`, if given, gets a line for each step: index or scan, and how many it looked at. Under
/// the lock of the connection.
std::vector<Behavior> findBehaviors(SqliteConnection& connection, SqliteFieldIndex& index,
                                    const BehaviorFilter& filter, bool open_are_incomplete,
                                    std::vector<std::string>* steps);

}  // namespace afterglow::replay
