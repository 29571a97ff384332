#include "nodes/console/behavior_index.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "nodes/console/behavior_search.hpp"
#include "replay/store/behavior_edit.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kPublishedAtOnce = 50, kMostDetails = 32;
constexpr auto kPeriod = std::chrono::seconds(1);

/// Behaviors that are equal by this look the same to everybody.
bool isSame(const replay::Behavior& some, const replay::Behavior& other,
            const std::vector<std::string>& notes) {
  return some.name == other.name && some.outcome == other.outcome && some.tags == other.tags &&
         some.begin == other.begin && some.end == other.end && some.parent == other.parent &&
         some.attempt == other.attempt && some.tree_path == other.tree_path &&
         some.parameters == other.parameters && some.remarks == other.remarks &&
         some.robot == other.robot && notes == replay::notesOf(other);
}

std::shared_ptr<IndexedBehavior> indexedOf(const replay::Behavior& behavior) {
  auto indexed = std::make_shared<IndexedBehavior>();
  static_cast<BehaviorSummary&>(*indexed) = summaryOf(behavior);
  indexed->searched = searchedText(*indexed);
  return indexed;
}

/// Null if the behavior is no longer in the store.
std::shared_ptr<BehaviorDetail> detailOf(const replay::Store& store, const IndexedBehaviors& all,
                                         std::shared_ptr<const IndexedBehavior> one) {
  const auto behavior = store.behavior(one->behavior.id);
  if (!behavior) return nullptr;
  auto detail = std::make_shared<BehaviorDetail>();
  detail->behavior = *behavior;
  detail->summary = std::move(one);
  for (const auto& other : all) {
    if (other->behavior.parent == behavior->id) detail->children.push_back(other);
    if (isAttemptOf(other->behavior, *behavior)) detail->attempts.push_back(other);
  }
  addStory(store, *detail);
  return detail;
}

}  // namespace

BehaviorIndex::BehaviorIndex(const replay::Store& store)
    : store_(store),
      all_(std::make_shared<const IndexedBehaviors>()),
      thread_(kPeriod, [this] { read(); }) {}

std::shared_ptr<const IndexedBehaviors> BehaviorIndex::all() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return all_;
}

std::shared_ptr<const IndexedBehavior> BehaviorIndex::find(std::int64_t id) const {
  const auto behaviors = all();
  const auto found = std::find_if(behaviors->begin(), behaviors->end(),
                                  [id](const auto& one) { return one->behavior.id == id; });
  return found == behaviors->end() ? nullptr : *found;
}

std::string BehaviorIndex::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

void BehaviorIndex::read() {
  std::string problem;
  try {
    readAll();
  } catch (const std::exception& error) {
    problem = error.what();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  problem_ = problem;
}

void BehaviorIndex::readAll() {
  const std::vector<replay::Behavior> behaviors = store_.behaviors({});
  Known left;
  for (const replay::Behavior& behavior : behaviors) {
    const auto found = known_.find(behavior.id);
    const bool is_known =
        found != known_.end() && isSame(found->second->behavior, behavior, found->second->notes);
    left[behavior.id] = is_known ? found->second : indexedOf(behavior);
    // What still grows is read again every time.
    if (!is_known || replay::isOpen(behavior)) is_heard_.erase(behavior.id);
  }
  known_ = std::move(left);
  publish(behaviors);
  readMessages(behaviors);
}

void BehaviorIndex::readMessages(const std::vector<replay::Behavior>& behaviors) {
  std::size_t read = 0;
  for (const replay::Behavior& behavior : behaviors) {
    if (is_heard_.count(behavior.id) != 0) continue;
    if (!thread_.sleepUntil({})) return;  // the program ends
    auto indexed = std::make_shared<IndexedBehavior>(*known_[behavior.id]);
    addMessages(store_, *indexed);
    indexed->searched = searchedText(*indexed);
    known_[behavior.id] = std::move(indexed);
    is_heard_[behavior.id] = true;
    if (++read % kPublishedAtOnce == 0) publish(behaviors);
  }
  if (read > 0) publish(behaviors);
}

void BehaviorIndex::publish(const std::vector<replay::Behavior>& order) {
  auto all = std::make_shared<IndexedBehaviors>();
  all->reserve(order.size());
  for (const replay::Behavior& behavior : order) all->push_back(known_[behavior.id]);
  const std::lock_guard<std::mutex> lock(mutex_);
  all_ = std::move(all);
}

std::shared_ptr<const BehaviorDetail> BehaviorDetails::find(std::int64_t id) {
  const auto one = index_.find(id);
  if (!one) return nullptr;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto kept = std::find_if(kept_.begin(), kept_.end(),
                                   [&](const auto& detail) { return detail->summary == one; });
    if (kept != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, kept);
      return kept_.front();
    }
  }
  const std::shared_ptr<const BehaviorDetail> detail = detailOf(store_, *index_.all(), one);
  const std::lock_guard<std::mutex> lock(mutex_);
  kept_.remove_if([id](const auto& other) { return other->behavior.id == id; });
  if (!detail) return nullptr;
  kept_.push_front(detail);
  if (kept_.size() > kMostDetails) kept_.pop_back();
  return detail;
}

}  // namespace afterglow::nodes
