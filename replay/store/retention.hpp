/// \file
/// Old behaviors make room.
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
  std::optional<Stamp> ended_before;        ///< these go
  std::optional<std::uint64_t> most_bytes;  ///< of the store; the oldest go until it has no more
  std::vector<std::string> keep_tags;       ///< behaviors with one of these stay, whatever happens
};

/// Removes whole behaviors, oldest first (by begin), and returns them. Those that run stay. A
/// message goes with the last behavior that covers it. What was removed is room for new messages;
/// Store::compact() gives it back to the disk. Throws StoreError, also if the size matters and the
/// store does not know its own.
std::vector<Behavior> prune(Store& store, const RetentionPolicy& policy,
                            const std::function<void(const Behavior&)>& removed = {});

/// What prune() would remove. Other writers wait meanwhile if the size matters: it is removed and
/// put back.
std::vector<Behavior> pruneWould(Store& store, const RetentionPolicy& policy);

}  // namespace afterglow::replay
