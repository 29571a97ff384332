/// \file
/// Looks after a SQLite store: what it holds, whether it is whole, and what of it can be saved.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

struct StoreStats {
  struct Topic {
    std::string topic, type;
    std::uint64_t messages = 0, bytes = 0;
  };
  struct Held {
    std::int64_t id = 0;
    std::string name;
    Stamp begin;
    std::uint64_t messages = 0, bytes = 0;
  };
  std::uint64_t file_bytes = 0;  ///< size with the log of commits
  std::uint64_t free_bytes = 0;  ///< bytes of these, to be used again
  std::uint64_t recordings = 0, behaviors = 0, messages = 0, files = 0;
  std::optional<Stamp> oldest, newest;  ///< stamps of the messages
  std::vector<Topic> topics;            ///< topics with most bytes first
  std::vector<Held> largest;            ///< behaviors with most bytes, ten at most
  std::optional<std::string> recorder;  ///< recorder that runs now
};

/// Looks at every message's row, not at its bytes. Throws StoreError.
StoreStats storeStats(const std::string& path);

/// Called with the number of messages that are done.
using StoreProgress = std::function<void(std::uint64_t done, std::uint64_t total)>;

struct StoreCheck {
  std::uint64_t messages = 0;
  std::uint64_t dead_imports = 0;     ///< no damage: the next import, or prune(), drops them
  std::vector<std::string> problems;  ///< a sentence each; empty: the store is whole
};

/// Reads everything: SQLite's structures, every message's checksum, references between rows,
/// behaviors and their counts, files. Recording may go on meanwhile. Throws StoreError if the file
/// cannot be opened as a store.
StoreCheck checkStore(const std::string& path, const StoreProgress& progress = {});

struct StoreRepair {
  std::uint64_t messages = 0;     ///< kept
  std::vector<std::string> lost;  ///< a sentence each
  std::string damaged_path;       ///< place of the damaged file now
};

/// Copies every row that can be read, and every message whose checksum holds, into a new store,
/// which takes the place of the damaged one; the damaged file is kept as PATH.damaged. Refused
/// while a recorder has the store open. Throws StoreError, and leaves everything as it was, if not
/// even the table of tables can be read, or the disk has no room for the copy.
StoreRepair repairStore(const std::string& path, const StoreProgress& progress = {});

}  // namespace afterglow::replay
