#include "nodes/console/behavior_detail.hpp"

#include <algorithm>

#include "nodes/console/http_message.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostKept = 32;

bool isAttemptOf(const replay::Behavior& other, const replay::Behavior& behavior) {
  return other.name == behavior.name && other.tree_path == behavior.tree_path &&
         other.parent == behavior.parent && other.recording == behavior.recording &&
         other.id != behavior.id && (other.attempt > 1 || behavior.attempt > 1);
}

std::shared_ptr<BehaviorDetail> readDetail(const replay::Store& store, const IndexedBehaviors& all,
                                           std::shared_ptr<const IndexedBehavior> one) {
  auto detail = std::make_shared<BehaviorDetail>();
  const auto behavior = store.behavior(one->behavior.id);
  if (!behavior) throw HttpError(404, "there is no behavior of this id");
  detail->behavior = *behavior;
  detail->one = std::move(one);
  for (const auto& other : all) {
    if (other->behavior.parent == behavior->id) detail->children.push_back(other);
    if (isAttemptOf(other->behavior, *behavior)) detail->attempts.push_back(other);
  }
  detail->lanes = topicLanes(store, *behavior);
  detail->story = tellStory(*detail->one, detail->lanes, detail->children);
  return detail;
}

}  // namespace

std::shared_ptr<const BehaviorDetail> BehaviorDetails::of(std::int64_t id) {
  const auto one = index_.find(id);
  if (!one) throw HttpError(404, "there is no behavior of this id");
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto kept = std::find_if(kept_.begin(), kept_.end(),
                                   [&](const auto& detail) { return detail->one == one; });
    if (kept != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, kept);
      return kept_.front();
    }
  }
  std::shared_ptr<const BehaviorDetail> detail = readDetail(store_, *index_.all(), one);
  const std::lock_guard<std::mutex> lock(mutex_);
  kept_.remove_if([id](const auto& other) { return other->behavior.id == id; });
  kept_.push_front(detail);
  if (kept_.size() > kMostKept) kept_.pop_back();
  return detail;
}

}  // namespace afterglow::nodes
