/// \file
/// Looks whether a SQLite store is whole.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace afterglow::replay {

/// Hears how many messages of how many are done.
using StoreProgress = std::function<void(std::uint64_t done, std::uint64_t total)>;

struct StoreCheck {
  std::uint64_t messages = 0;
  std::uint64_t dead_imports = 0;     ///< no damage: the next import, or prune(), drops them
  std::vector<std::string> problems;  ///< a sentence each, with what it touches; empty: all is well
};

/// Reads everything: SQLite's structures, every message's checksum, references between rows,
/// behaviors and their counts, files. Recording may go on meanwhile. Throws StoreError if the file
/// cannot be opened as a store.
StoreCheck checkStore(const std::string& path, const StoreProgress& progress = {});

}  // namespace afterglow::replay
