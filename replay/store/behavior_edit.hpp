/// \file
/// Changes to behaviors that have been recorded: their names, tags, notes, outcomes, intervals.
#pragma once

#include <cstdint>
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

}  // namespace afterglow::replay
