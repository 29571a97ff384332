#include <algorithm>
#include <stdexcept>

#include "replay/record/recorder.hpp"

namespace afterglow::replay {
namespace {

/// "kitting" contains "kitting/pick", not "kitting2".
bool contains(const std::string& outer, const std::string& inner) {
  return !outer.empty() && inner.size() > outer.size() &&
         inner.compare(0, outer.size(), outer) == 0 && inner[outer.size()] == '/';
}

}  // namespace

Behavior Recorder::begin(Behavior behavior, const RecordingTerms& terms) {
  const std::lock_guard<std::mutex> row(rows_mutex_);  // a discard would not spare it before
  const std::optional<std::string> failed_before = failure();
  // Its messages are kept from here on; the store is asked without holding up those who offer.
  const std::int64_t provisional = admit(behavior, terms);
  try {
    behavior.id = store_.addBehavior(behavior);
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    retire(provisional);
    if (!failure_) failure_ = failed_before;
    throw;
  }
  rename(provisional, behavior.id);
  return behavior;
}

std::int64_t Recorder::admit(Behavior& behavior, const RecordingTerms& terms) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (failure_ && !running_.empty()) {
    throw StoreError(*failure_);
  }
  failure_.reset();  // the disk may have room again
  const Stamp now = orderly(behavior.begin);
  if (went_back_ && running_.empty()) {
    recording_ = store_.addRecording({0, "", options_.source, options_.robot});
    went_back_ = false;
  }
  behavior.recording = recording_;
  behavior.end.reset();
  behavior.begin = past_.reach(now, terms.pre_roll_ns);
  behavior.wall_begin.ns -= now.ns - behavior.begin.ns;
  if (behavior.robot.empty()) {
    behavior.robot = options_.robot;
  }
  if (behavior.parent == 0) {
    behavior.parent = enclosing(behavior.tree_path);
  }
  if (behavior.attempt == 0) {
    behavior.attempt = nextAttempt(behavior);
  }
  const std::int64_t provisional = -++unstored_;
  enqueuePast(running_.emplace(provisional, RunningBehavior(behavior, terms.limits)).first->second);
  return provisional;
}

void Recorder::rename(std::int64_t from, std::int64_t to) {
  const std::lock_guard<std::mutex> lock(mutex_);
  auto node = running_.extract(from);
  node.key() = to;
  node.mapped().setId(to);
  running_.insert(std::move(node));
}

void Recorder::enqueuePast(const RunningBehavior& running) {
  const Stamp begin = running.behavior().begin;
  std::set<std::string> topics = context_;
  topics.insert(running.behavior().topics.begin(), running.behavior().topics.end());
  topics.insert(running.answers().begin(), running.answers().end());
  for (LatchedState::Entry& entry :
       past_.latchedAt(begin, {topics.begin(), topics.end()}, channels_)) {
    Message message;
    message.received = begin;
    message.sequence = next_sequence_++;
    message.bytes = std::move(entry.bytes);
    enqueue(entry.channel_index, std::move(message));
  }
  const auto is_wanted = [&](std::size_t channel) {
    return topics.count(channels_[channel].topic) != 0;
  };
  for (PreRoll::Entry& entry : past_.take(begin, is_wanted)) {
    if (wants(channels_[entry.channel_index].topic, entry.received) != Want::Yes) continue;
    Message message;
    message.received = entry.received;
    message.sequence = entry.sequence;
    message.bytes = std::move(entry.bytes);
    enqueue(entry.channel_index, std::move(message));
  }
}

std::int64_t Recorder::enclosing(const std::string& tree_path) const {
  const Behavior* deepest = nullptr;
  for (const auto& [id, running] : running_) {
    const Behavior& candidate = running.behavior();
    if (id > 0 && contains(candidate.tree_path, tree_path) &&
        (!deepest || candidate.tree_path.size() >= deepest->tree_path.size())) {
      deepest = &candidate;
    }
  }
  return deepest ? deepest->id : 0;
}

int Recorder::nextAttempt(const Behavior& behavior) {
  if (behavior.parent == 0 && behavior.tree_path.empty()) {
    return 1;
  }
  return ++attempts_[{behavior.parent, behavior.tree_path, behavior.name}];
}

void Recorder::addTopics(std::int64_t behavior_id, const std::vector<std::string>& topics) {
  const std::lock_guard<std::mutex> row(rows_mutex_);
  std::unique_lock<std::mutex> lock(mutex_);
  for (const std::string& topic : topics) {
    running(behavior_id).addTopic(topic);
  }
  const Behavior changed = running(behavior_id).behavior();
  lock.unlock();
  try {
    store_.updateBehavior(changed);
  } catch (const StoreBusy&) {
    // Its end writes them; until then they are only missing should the recorder die.
  }
}

RecordedCounts Recorder::end(std::int64_t behavior_id, Stamp end, const std::string& outcome) {
  return this->end(behavior_id, end,
                   [&outcome](Behavior& behavior, const auto&) { behavior.outcome = outcome; });
}

RecordedCounts Recorder::end(std::int64_t behavior_id, Stamp end, const Completion& complete) {
  std::unique_lock<std::mutex> lock(mutex_);
  // Behind the last stamp given, even if the clock stands still.
  running(behavior_id).setEnd(std::max(orderly(end), Stamp{last_.ns + 1}));
  flush(lock);
  const RunningBehavior ended = running(behavior_id);
  retire(behavior_id);
  lock.unlock();
  Behavior behavior = ended.written();
  bool is_complete = false;
  insist([&] {
    if (!is_complete) {
      Behavior completed = behavior;  // anew each time
      complete(completed, ended.references());
      behavior = std::move(completed);
      is_complete = true;
    }
    const std::lock_guard<std::mutex> row(rows_mutex_);
    store_.updateBehavior(behavior);
  });
  return ended.counts();
}

void Recorder::discard(std::int64_t behavior_id) {
  insist([&] {
    const std::lock_guard<std::mutex> row(rows_mutex_);
    store_.removeBehavior(behavior_id);
  });
  const std::lock_guard<std::mutex> lock(mutex_);
  past_.limitReach(last_);
}

void Recorder::hurry() {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_hurried_ = true;
  from_writer_.notify_all();
}

void Recorder::retire(std::int64_t behavior_id) {
  running_.erase(behavior_id);
  const auto first = attempts_.lower_bound({behavior_id, "", ""});
  attempts_.erase(first, attempts_.lower_bound({behavior_id + 1, "", ""}));
  if (running_.empty() && ahead_ns_ != 0) {
    last_.ns -= std::exchange(ahead_ns_, 0);
    past_.startAgain(last_, channels_);
  }
}

RecordedCounts Recorder::counts(std::int64_t behavior_id) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = running_.find(behavior_id);
  return found == running_.end() ? RecordedCounts{} : found->second.counts();
}

RecorderLoad Recorder::load() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  RecorderLoad load = load_;
  load.queued_bytes = queued_bytes_;
  return load;
}

RunningBehavior& Recorder::running(std::int64_t behavior_id) {
  const auto found = running_.find(behavior_id);
  if (found == running_.end()) {
    throw std::logic_error("behavior " + std::to_string(behavior_id) + " is not being recorded");
  }
  return found->second;
}

std::optional<std::string> Recorder::failure() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return failure_;
}

}  // namespace afterglow::replay
