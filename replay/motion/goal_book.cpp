#include "replay/motion/goal_book.hpp"

#include <algorithm>
#include <utility>

#include "replay/messages/ranges.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::replay {
namespace {

bool wasCanceled(const GoalBook::Entry& goal) {
  return goal.milestone && goal.milestone->outcome == GoalOutcome::Canceled;
}

bool isAny(const GoalBook::Entry&) { return true; }

}  // namespace

void GoalBook::open(const std::string& topic, const std::string& id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (find(id, topic) == open_.end()) open_.push_back({topic, id, {}});
}

void GoalBook::cancel(const std::string& topic, const std::string& id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto is_meant = [&](const Open& goal) {
    return goal.topic == topic && (id.empty() || goal.id == id);
  };
  // Of recorded goals those that a recorded cancel ends: others are given up before.
  counts_.canceled += static_cast<std::uint64_t>(
      std::count_if(open_.begin(), open_.end(),
                    [&](const Open& goal) { return is_meant(goal) && goal.recorded; }));
  open_.erase(std::remove_if(open_.begin(), open_.end(), is_meant), open_.end());
}

void GoalBook::close(const std::string& id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = find(id);
  if (found != open_.end()) open_.erase(found);
}

bool GoalBook::isOpen(const std::string& topic) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return anyOf(open_, [&](const Open& goal) { return goal.topic == topic; });
}

bool GoalBook::finish(const std::string& id, GoalOutcome outcome, SteadyTime at,
                      const std::string& how) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = find(id);
  if (found == open_.end() || outcome == GoalOutcome::Open) {
    return false;
  }
  ends_[id] = {outcome, how};
  std::optional<Entry> recorded = std::move(found->recorded);
  open_.erase(found);
  if (!recorded) {
    return false;
  }
  ended_.push_back({std::move(*recorded), outcome, at, how});
  counts_.succeeded += outcome == GoalOutcome::Succeeded;
  counts_.failed += outcome == GoalOutcome::Failed;
  counts_.canceled += outcome == GoalOutcome::Canceled;
  return true;
}

std::pair<GoalOutcome, std::string> GoalBook::endOf(const std::string& id) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = ends_.find(id);
  return found == ends_.end() ? std::pair(GoalOutcome::Open, std::string()) : found->second;
}

// -------------------------------------------------------------------------------- recorded goals

void GoalBook::add(const std::string& topic, Entry entry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.sent;
  auto found = find(entry.id, topic);
  if (found == open_.end()) found = open_.insert(open_.end(), {topic, entry.id, {}});
  found->recorded = std::move(entry);
}

std::vector<GoalBook::Ended> GoalBook::takeEnded() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(ended_, {});
}

std::optional<std::pair<std::string, Milestone>> GoalBook::nextMilestone() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Entry* next = nullptr;
  for (const Open& goal : open_) {
    const std::optional<Milestone> end = goal.recorded ? goal.recorded->milestone : std::nullopt;
    const bool is_awaited = end && end->is_awaited;
    if (is_awaited && (!next || end->at < next->milestone->at)) next = &*goal.recorded;
  }
  return next ? std::optional(std::pair(next->channel.topic, *next->milestone)) : std::nullopt;
}

void GoalBook::giveUpWaiting(Stamp until) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (Open& goal : open_) {
    if (!goal.recorded) continue;
    std::optional<Milestone>& milestone = goal.recorded->milestone;
    if (milestone && milestone->at <= until) milestone->is_awaited = false;
  }
}

std::vector<GoalBook::Entry> GoalBook::giveUp() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<Entry> goals = takeOpen(isAny);
  counts_.canceled += goals.size() + suspended_.size();
  suspended_.clear();
  return goals;
}

std::vector<GoalBook::Entry> GoalBook::suspendOpen() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<Entry> goals = takeOpen(isAny);
  suspended_.insert(suspended_.end(), goals.begin(), goals.end());
  return goals;
}

std::vector<GoalBook::Entry> GoalBook::takeSuspended() {
  const std::lock_guard<std::mutex> lock(mutex_);
  counts_.sent -= suspended_.size();
  return std::exchange(suspended_, {});
}

void GoalBook::suspend(Entry entry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.sent;  // as one that was sent before, as those that a pause suspends
  suspended_.push_back(std::move(entry));
}

bool GoalBook::hasOpen() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return anyOf(open_, [](const Open& goal) { return goal.recorded.has_value(); });
}

std::vector<GoalBook::Entry> GoalBook::openOn(const std::string& recorded_topic) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<Entry> goals;
  for (const Open& goal : open_) {
    if (goal.recorded && goal.recorded->channel.topic == recorded_topic) {
      goals.push_back(*goal.recorded);
    }
  }
  return goals;
}

std::optional<Stamp> GoalBook::nextCanceled() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::optional<Stamp> next;
  for (const Open& goal : open_) {
    if (!goal.recorded || !wasCanceled(*goal.recorded)) continue;
    const Stamp at = goal.recorded->milestone->at;
    next = next ? std::min(*next, at) : at;
  }
  return next;
}

std::vector<GoalBook::Entry> GoalBook::giveUpCanceled(Stamp until) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<Entry> goals = takeOpen([until](const Entry& goal) {
    return wasCanceled(goal) && goal.milestone->at <= until;
  });
  counts_.canceled += goals.size();
  return goals;
}

GoalBook::Counts GoalBook::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counts_;
}

/// Finds a goal on any topic, without a topic given.
std::vector<GoalBook::Open>::iterator GoalBook::find(const std::string& id,
                                                     const std::string& topic) {
  return std::find_if(open_.begin(), open_.end(), [&](const Open& goal) {
    return goal.id == id && (topic.empty() || goal.topic == topic);
  });
}

/// Takes open goals, which stay open until their cancels are sent.
std::vector<GoalBook::Entry> GoalBook::takeOpen(
    const std::function<bool(const Entry&)>& is_meant) {
  std::vector<Entry> goals;
  for (Open& goal : open_) {
    if (!goal.recorded || !is_meant(*goal.recorded)) continue;
    goals.push_back(*std::exchange(goal.recorded, std::nullopt));
  }
  return goals;
}

Bytes cancelMessage(const std::string& goal_id) {
  Bytes bytes(8);  // stamp
  const auto size = static_cast<std::uint32_t>(goal_id.size());
  for (int shift = 0; shift < 32; shift += 8) {
    bytes.push_back(static_cast<std::uint8_t>(size >> shift));
  }
  bytes.insert(bytes.end(), goal_id.begin(), goal_id.end());
  return bytes;
}

Channel cancelChannel(const Channel& goal_channel) {
  Channel channel;
  channel.topic = actionOf(goal_channel.topic) + "/cancel";
  channel.type = kGoalIdType;
  channel.md5 = "302881f31927c1df708a2dbab0e80ee8";
  channel.definition = "time stamp\nstring id\n";
  return channel;
}

}  // namespace afterglow::replay
