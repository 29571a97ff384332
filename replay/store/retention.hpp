/// \file
/// Removes old behaviors to make room.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Unset members keep everything.
struct RetentionPolicy {
  std::optional<Stamp> ended_before;        ///< behaviors that ended before this go
  std::optional<std::uint64_t> most_bytes;  ///< the oldest go until the store has no more than this
  std::vector<std::string> keep_tags;       ///< behaviors with one of these stay in any case
};

/// Removes whole behaviors, oldest first (by begin), and returns them. Running behaviors stay. A
/// message goes with the last behavior that covers it. The room is used for new messages;
/// Store::compact() gives it back to the disk. Throws StoreError, also if `most_bytes` is set and
/// the store does not know its size.
std::vector<Behavior> prune(Store& store, const RetentionPolicy& policy,
                            const std::function<void(const Behavior&)>& removed = {});

/// Returns what prune() would remove. It is removed and put back, in a transaction for which other
/// writers wait.
std::vector<Behavior> pruneWould(Store& store, const RetentionPolicy& policy);

}  // namespace afterglow::replay
