/// \file
/// Changes to behaviors that have been recorded: their names, tags, notes, outcomes, intervals.
///
/// Removes old behaviors to make room.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

struct BehaviorEdit {
  std::optional<std::string> name, outcome;
  std::vector<std::string> add_tags, remove_tags;
  std::vector<std::string> notes;  ///< further ones
  /// The part that stays, in nanoseconds since the behavior's begin; unset: from its begin, to its
  /// end.
  std::optional<std::int64_t> from_ns, to_ns;

  bool isTrim() const { return from_ns || to_ns; }
};

/// Returns the notes of people on a behavior: "notes" of its snapshot, an array of texts.
std::vector<std::string> notesOf(const Behavior& behavior);

/// Throws StoreError unless the behavior has ended: its recorder would undo what is changed.
void requireEnded(const Behavior& behavior);

/// Makes all of the changes or, with a StoreError, none; returns the behavior as it is then. A trim
/// removes the messages outside that no other behavior covers. Of latched topics the last message
/// from before the new begin is kept, stamped with it, as a recorder does.
Behavior editBehavior(Store& store, std::int64_t id, const BehaviorEdit& edit);

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
