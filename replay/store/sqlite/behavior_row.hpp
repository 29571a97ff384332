/// \file
/// A behavior as a row of a SQLite store. Internal to replay/store.
#pragma once

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// The columns that readBehavior() reads; conditions may follow.
constexpr const char* kBehaviorColumns =
    "SELECT id, recording, name, tree_path, parent, attempt, outcome, begin_ns, end_ns, robot, "
    "parameters, tags, calibration, topics, key, wall_begin_ns, snapshot, remarks FROM behaviors "
    "b ";

Behavior readBehavior(const SqliteStatement& row);

/// Its recorder runs, or died.
inline bool isOpen(const Behavior& behavior) { return !behavior.end && behavior.outcome.empty(); }

}  // namespace afterglow::replay
