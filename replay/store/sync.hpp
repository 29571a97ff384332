/// \file
/// Copies behaviors from one store to another: from a robot's file to the fleet's server, and back.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

struct SyncReport {
  std::size_t copied = 0;     ///< behaviors that the other store did not have
  std::size_t completed = 0;  ///< behaviors that it had without their end or parent
  std::size_t present = 0;    ///< behaviors that it had
  std::size_t open = 0;       ///< behaviors that still run: left for a later sync
  std::uint64_t messages = 0;  ///< messages within behaviors
  std::size_t files = 0;
  std::size_t damaged = 0;  ///< messages that could not be read any more
  std::size_t refused = 0;  ///< messages that the other store does not take
  std::string last_refusal;  ///< the last one refused, and why
};

/// The terms by which a recorder sends its behaviors (RecorderStore), other than `afterglow sync`.
struct SyncTerms {
  /// The copy has the original's id, and of a behavior that is there with fewer messages the others
  /// are copied.
  bool is_sending = false;
  /// A message that the other store refuses does not keep out the rest.
  bool leaves_out_refused = false;
};

/// Called at the begin of every behavior, and after every batch of messages.
using SyncProgress = std::function<void(std::size_t done, std::size_t all, const SyncReport&)>;

/// Copies the behaviors of `from` that `filter` names, oldest first, each with all messages of its
/// recording in its interval, the transforms before it (kTransformsBefore_ns), their channels, and
/// the files that its snapshot names. A recording or
/// behavior has the same key in both stores, ids differ; a parent is set if `to` has it. A behavior
/// is added after its messages: if a sync breaks off, the next one goes on from there. Behaviors
/// that `to` has are not changed, even if the two differ (tags, remarks). Throws StoreError.
SyncReport syncBehaviors(const Store& from, Store& to, const BehaviorFilter& filter,
                         const SyncProgress& progress = {});
/// The same of these behaviors of `from`, in this order.
SyncReport syncBehaviors(const Store& from, Store& to, const std::vector<Behavior>& behaviors,
                         const SyncTerms& terms, const SyncProgress& progress = {});

}  // namespace afterglow::replay
