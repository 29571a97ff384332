/// \file
/// What a SQLite store holds and how much room it takes.
#pragma once

#include <cstdint>
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
  std::uint64_t file_bytes = 0;  ///< with the log of commits
  std::uint64_t free_bytes = 0;  ///< of these, to be used again
  std::uint64_t recordings = 0, behaviors = 0, messages = 0, files = 0;
  std::optional<Stamp> oldest, newest;  ///< of the messages
  std::vector<Topic> topics;            ///< with most bytes first
  std::vector<Held> largest;            ///< behaviors with most bytes, ten at most
  std::optional<std::string> recorder;  ///< who records into it now
};

/// Looks at every message's row, not at its bytes. Throws StoreError.
StoreStats storeStats(const std::string& path);

}  // namespace afterglow::replay
