/// \file
/// Saves what can be read of a damaged SQLite store.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "replay/store/sqlite/store_check.hpp"

namespace afterglow::replay {

struct StoreRepair {
  std::uint64_t messages = 0;     ///< kept
  std::vector<std::string> lost;  ///< a sentence each; empty: nothing is
  std::string damaged_path;       ///< where the damaged file lies now
};

/// Copies every row that can be read, and every message whose checksum holds, into a new store,
/// which takes the place of the damaged one; that is kept as PATH.damaged. Refused while a recorder
/// has it open. Throws StoreError, and leaves everything as it was, if not even the table of tables
/// can be read, or the disk has no room for the copy.
StoreRepair repairStore(const std::string& path, const StoreProgress& progress = {});

}  // namespace afterglow::replay
