#include "replay/store/retention.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

bool isKept(const Behavior& behavior, const RetentionPolicy& policy) {
  const auto hasTag = [&](const std::string& tag) {
    return std::find(behavior.tags.begin(), behavior.tags.end(), tag) != behavior.tags.end();
  };
  return isOpen(behavior) || std::any_of(policy.keep_tags.begin(), policy.keep_tags.end(), hasTag);
}

bool isTooOld(const Behavior& behavior, const RetentionPolicy& policy) {
  return policy.ended_before && behavior.end.value_or(behavior.begin) < *policy.ended_before;
}

bool isTooLarge(const Store& store, const RetentionPolicy& policy) {
  if (!policy.most_bytes) return false;
  const auto used = store.usedBytes();
  if (!used) throw StoreError("the store does not know its size: nothing can be removed by size");
  return *used > *policy.most_bytes;
}

/// Thrown to undo a transaction.
struct Undo {};

}  // namespace

std::vector<Behavior> prune(Store& store, const RetentionPolicy& policy,
                            const std::function<void(const Behavior&)>& removed) {
  store.dropUnfinished();
  std::vector<Behavior> oldest_first = store.behaviors({});
  std::reverse(oldest_first.begin(), oldest_first.end());
  std::vector<Behavior> gone;
  bool is_too_large = isTooLarge(store, policy);
  for (Behavior& behavior : oldest_first) {
    if (isKept(behavior, policy)) continue;
    if (!is_too_large && !isTooOld(behavior, policy)) continue;
    store.removeBehavior(behavior.id);
    if (removed) removed(behavior);
    gone.push_back(std::move(behavior));
    is_too_large = is_too_large && isTooLarge(store, policy);
  }
  return gone;
}

std::vector<Behavior> pruneWould(Store& store, const RetentionPolicy& policy) {
  std::vector<Behavior> gone;
  if (!policy.most_bytes) {  // age alone: nothing has to be tried, and nobody waits for it
    gone = store.behaviors({});
    const auto stays = [&](const Behavior& behavior) {
      return isKept(behavior, policy) || !isTooOld(behavior, policy);
    };
    gone.erase(std::remove_if(gone.begin(), gone.end(), stays), gone.end());
    std::reverse(gone.begin(), gone.end());
    return gone;
  }
  try {
    store.transaction([&] {
      gone = prune(store, policy);
      throw Undo{};
    });
  } catch (const Undo&) {
    // The store is as it was.
  }
  return gone;
}

}  // namespace afterglow::replay
