#include "replay/motion/goal_book.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::replay {

void GoalBook::add(Entry entry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.sent;
  open_.push_back(std::move(entry));
}

bool GoalBook::finish(const std::string& id, GoalOutcome outcome, SteadyTime at) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found =
      std::find_if(open_.begin(), open_.end(), [&](const Entry& entry) { return entry.id == id; });
  if (found == open_.end() || outcome == GoalOutcome::Open) {
    return false;
  }
  ended_.push_back({std::move(*found), outcome, at});
  open_.erase(found);
  counts_.succeeded += outcome == GoalOutcome::Succeeded;
  counts_.failed += outcome == GoalOutcome::Failed;
  counts_.canceled += outcome == GoalOutcome::Canceled;
  return true;
}

std::vector<GoalBook::Ended> GoalBook::takeEnded() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(ended_, {});
}

std::optional<std::pair<std::string, Milestone>> GoalBook::nextMilestone() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Entry* next = nullptr;
  for (const Entry& entry : open_) {
    const bool is_awaited = entry.milestone && entry.milestone->is_awaited;
    if (is_awaited && (!next || entry.milestone->at < next->milestone->at)) next = &entry;
  }
  return next ? std::optional(std::pair(next->channel.topic, *next->milestone)) : std::nullopt;
}

void GoalBook::giveUpWaiting(Stamp until) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (Entry& entry : open_) {
    if (entry.milestone && entry.milestone->at <= until) entry.milestone->is_awaited = false;
  }
}

std::vector<GoalBook::Entry> GoalBook::cancelOpen() {
  const std::lock_guard<std::mutex> lock(mutex_);
  counts_.canceled += open_.size() + suspended_.size();
  suspended_.clear();
  return std::exchange(open_, {});
}

std::vector<GoalBook::Entry> GoalBook::suspendOpen() {
  const std::lock_guard<std::mutex> lock(mutex_);
  suspended_.insert(suspended_.end(), open_.begin(), open_.end());
  return std::exchange(open_, {});
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
  return !open_.empty();
}

GoalBook::Counts GoalBook::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counts_;
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
  channel.topic = goal_channel.topic.substr(0, goal_channel.topic.rfind('/')) + "/cancel";
  channel.type = "actionlib_msgs/GoalID";
  channel.md5 = "302881f31927c1df708a2dbab0e80ee8";
  channel.definition = "time stamp\nstring id\n";
  return channel;
}

}  // namespace afterglow::replay
