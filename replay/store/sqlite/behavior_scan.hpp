/// \file
/// Behaviors by what was in their messages: every message is read that a filter asks for, on all
/// processors. Internal to replay/store.
#pragma once

#include <string>
#include <vector>

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// Leaves those of `found` that match `filter.where`, `filter.limit` at most, in their order. Reads
/// through the connection, whose lock the caller holds; if that is null, through connections of its
/// own to the store in the file `path`. `steps`, if given, gets lines of Store::explain().
void filterBehaviors(SqliteConnection* connection, const std::string& path,
                     const BehaviorFilter& filter, std::vector<Behavior>& found,
                     std::vector<std::string>* steps);

}  // namespace afterglow::replay
