#include "replay/record/recorder.hpp"

#include <algorithm>
#include <stdexcept>

namespace afterglow::replay {
namespace {

/// Less is evened out: threads that take stamps at once, a clock that is disciplined.
constexpr std::int64_t kSetBack = 100'000'000;
constexpr std::size_t kMostNotices = 100;

/// "kitting" contains "kitting/pick", not "kitting2".
bool contains(const std::string& outer, const std::string& inner) {
  return !outer.empty() && inner.size() > outer.size() &&
         inner.compare(0, outer.size(), outer) == 0 && inner[outer.size()] == '/';
}

}  // namespace

Recorder::Recorder(Store& store, RecorderOptions options)
    : store_(store),
      options_(std::move(options)),
      context_(options_.context_topics.begin(), options_.context_topics.end()),
      recording_(store_.addRecording({0, "", options_.source, options_.robot})),
      past_(options_.pre_roll.count(), options_.pre_roll_bytes),
      writer_([this] { writeLoop(); }) {}

Recorder::~Recorder() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_closing_ = true;
  }
  to_writer_.notify_all();
  writer_.join();
}

// ------------------------------------------------------------------------------------ coming in

std::size_t Recorder::channelIndex(const Channel& channel) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known = std::find(channels_.begin(), channels_.end(), channel);
  if (known != channels_.end()) {
    return static_cast<std::size_t>(known - channels_.begin());
  }
  channels_.push_back(channel);
  return channels_.size() - 1;
}

void Recorder::offer(std::size_t channel_index, Stamp received, Bytes bytes) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Channel& channel = channels_.at(channel_index);
  Message message;
  message.received = orderly(received);
  message.sequence = next_sequence_++;
  const Want want = wants(channel.topic, message.received);
  if (channel.latching || want == Want::No) {
    PreRoll::Entry entry{channel_index,    message.received, message.sequence,
                         channel.latching, want != Want::No, {}};
    entry.bytes = want == Want::Yes ? bytes : std::move(bytes);
    past_.push(std::move(entry), channels_);
  }
  if (want == Want::Yes) {
    message.bytes = std::move(bytes);
    enqueue(channel_index, std::move(message));
  }
}

void Recorder::forgetLatched(const std::string& topic) {
  const std::lock_guard<std::mutex> lock(mutex_);
  past_.forget(topic, channels_);
}

Recorder::Want Recorder::wants(const std::string& topic, Stamp received) {
  Want want = Want::No;
  for (auto& [id, running] : running_) {
    if (covers(running, topic, received)) {
      want = running.keeps(topic, received) || want == Want::Yes ? Want::Yes : Want::LeftOut;
    }
  }
  return want;
}

void Recorder::enqueue(std::size_t channel_index, Message message) {
  Queued queued{recording_, channel_index, message.bytes.size() + sizeof(Queued),
                std::move(message)};
  if (failure_ || queued_bytes_ + queued.size > options_.queue_bytes) {
    drop(queued);
    return;
  }
  const bool was_half_full = queued_bytes_ > options_.queue_bytes / 2;
  queued_bytes_ += queued.size;
  ++enqueued_;
  queue_.push_back(std::move(queued));
  const bool is_half_full = queued_bytes_ > options_.queue_bytes / 2;
  if (queue_.size() == 1 || is_half_full != was_half_full) {
    to_writer_.notify_one();
  }
}

void Recorder::drop(const Queued& queued) {
  ++load_.dropped;
  const std::string& topic = channels_[queued.channel_index].topic;
  for (auto& [id, running] : running_) {
    if (covers(running, topic, queued.message.received)) {
      running.countDropped(topic);
      if (failure_) running.setReason(*failure_);
    }
  }
}

// --------------------------------------------------------------------------------------- clocks

void Recorder::look(const ClockReading& now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  orderly(now.ros);
  if (const std::optional<std::string> text = clock_watch_.look(now)) {
    notice(*text);
  }
}

Stamp Recorder::orderly(Stamp clock) {
  const Stamp shifted{clock.ns + ahead_ns_};
  const std::int64_t back = last_.ns - shifted.ns;
  if (back <= kSetBack) {
    last_ = std::max(last_, shifted);
    return last_;
  }
  went_back_ = true;
  std::string text = "ROS time went back by " + secondsText(back) + " to " + secondsText(clock.ns);
  if (running_.empty()) {
    last_ = clock;
  } else {
    ahead_ns_ += back;
    text +=
        "; from then on stamps of this recording are " + secondsText(ahead_ns_) + " ahead of it";
  }
  past_.startAgain(last_, channels_);
  notice(text);
  return last_;
}

void Recorder::notice(const std::string& text) {
  for (auto& [id, running] : running_) {
    running.remark(text);
  }
  if (notices_.size() < kMostNotices) {
    notices_.push_back(text);
  }
}

std::vector<std::string> Recorder::takeNotices() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(notices_, {});
}

// ------------------------------------------------------------------------------------ behaviors

Behavior Recorder::begin(Behavior behavior, const RecordingTerms& terms) {
  const std::lock_guard<std::mutex> row(rows_mutex_);  // a discard would not spare it before
  // Its messages are kept from here on; the store is asked without holding up those who offer.
  const std::int64_t provisional = admit(behavior, terms);
  try {
    behavior.id = store_.addBehavior(behavior);
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    retire(provisional);
    throw;
  }
  rename(provisional, behavior.id);
  return behavior;
}

std::int64_t Recorder::admit(Behavior& behavior, const RecordingTerms& terms) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (failure_) {
    throw StoreError(*failure_);
  }
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
  store_.updateBehavior(changed);
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
  complete(behavior, ended.references());
  const std::lock_guard<std::mutex> row(rows_mutex_);
  store_.updateBehavior(behavior);
  return ended.counts();
}

void Recorder::discard(std::int64_t behavior_id) {
  const std::lock_guard<std::mutex> row(rows_mutex_);
  store_.removeBehavior(behavior_id);
  const std::lock_guard<std::mutex> lock(mutex_);
  past_.limitReach(last_);
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
