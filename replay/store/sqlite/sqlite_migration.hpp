/// \file
/// Older stores are made current. Internal to replay/store.
#pragma once

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// Makes version 2's tables of version 1's, in the transaction that is open; the caller sets the
/// version. Recordings and behaviors are given keys. Needs as much space again as the store has.
void migrateFromVersion1(SqliteConnection& connection);

}  // namespace afterglow::replay
