#include "replay/record/recorder.hpp"

#include <algorithm>
#include <stdexcept>

#include "replay/messages/field_edit.hpp"

namespace afterglow::replay {
namespace {

/// "kitting" contains "kitting/pick", not "kitting2".
bool contains(const std::string& outer, const std::string& inner) {
  return !outer.empty() && inner.size() > outer.size() &&
         inner.compare(0, outer.size(), outer) == 0 && inner[outer.size()] == '/';
}

bool isWithin(const Behavior& behavior, Stamp received) {
  return received >= behavior.begin && (!behavior.end || received < *behavior.end);
}

/// A definition nobody understands is recorded all the same, as bytes.
std::optional<Schema> parse(const Channel& channel) {
  try {
    return Schema::parse(channel.type, channel.definition);
  } catch (const MessageError&) {
    return std::nullopt;
  }
}

std::optional<Stamp> stampOf(const std::optional<Schema>& schema, const Bytes& bytes) {
  try {
    return schema ? headerStamp(*schema, bytes) : std::nullopt;
  } catch (const MessageError&) {
    return std::nullopt;  // bytes that do not fit their type are evidence, too
  }
}

}  // namespace

Recorder::Recorder(Store& store, RecorderOptions options)
    : store_(store),
      options_(std::move(options)),
      context_(options_.context_topics.begin(), options_.context_topics.end()),
      recording_(store_.addRecording({0, "", options_.source, options_.robot})),
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
  if (channel.latching) {
    latched_.remember(channel_index, channel, bytes);
  }
  if (isWanted(channel.topic, received)) {
    enqueue(channel_index, received, std::move(bytes));
  }
}

void Recorder::forgetLatched(const std::string& topic) {
  const std::lock_guard<std::mutex> lock(mutex_);
  latched_.forget(topic);
}

bool Recorder::isWanted(const std::string& topic, Stamp received) const {
  return std::any_of(running_.begin(), running_.end(), [&](const auto& entry) {
    const Running& running = entry.second;
    return isWithin(running.behavior, received) &&
           (isContext(topic) || running.topics.count(topic));
  });
}

void Recorder::enqueue(std::size_t channel_index, Stamp received, Bytes bytes) {
  Queued queued{channel_index, bytes.size() + sizeof(Queued), {}};
  queued.message.received = received;
  queued.message.bytes = std::move(bytes);
  if (failure_ || queued_bytes_ + queued.size > options_.queue_bytes) {
    count(queued, &Running::dropped);
    return;
  }
  queued.message.sequence = next_sequence_++;
  queued_bytes_ += queued.size;
  queue_.push_back(std::move(queued));
  to_writer_.notify_one();
}

void Recorder::count(const Queued& queued, std::uint64_t Running::*counter) {
  const std::string& topic = channels_[queued.channel_index].topic;
  for (auto& [id, running] : running_) {
    if (running.topics.count(topic) != 0 && isWithin(running.behavior, queued.message.received)) {
      running.*counter += 1;
      running.heard.insert(topic);
    }
  }
}

// ------------------------------------------------------------------------------------ behaviors

Behavior Recorder::begin(Behavior behavior) {
  // Its messages are kept from here on; the store is asked without holding up those who offer.
  const std::int64_t provisional = admit(behavior);
  try {
    behavior.id = store_.addBehavior(behavior);
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    running_.erase(provisional);
    throw;
  }
  rename(provisional, behavior.id);
  return behavior;
}

std::int64_t Recorder::admit(Behavior& behavior) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (failure_) {
    throw StoreError(*failure_);
  }
  behavior.recording = recording_;
  behavior.end.reset();
  if (behavior.robot.empty()) {
    behavior.robot = options_.robot;
  }
  if (behavior.parent == 0) {
    behavior.parent = enclosing(behavior.tree_path);
  }
  Running running;
  running.behavior = behavior;
  running.topics = {behavior.topics.begin(), behavior.topics.end()};
  const std::int64_t provisional = -++unstored_;
  enqueueLatched(running_.emplace(provisional, std::move(running)).first->second);
  return provisional;
}

void Recorder::rename(std::int64_t from, std::int64_t to) {
  const std::lock_guard<std::mutex> lock(mutex_);
  auto node = running_.extract(from);
  node.key() = to;
  node.mapped().behavior.id = to;
  running_.insert(std::move(node));
}

void Recorder::enqueueLatched(const Running& running) {
  std::set<std::string> topics = context_;
  topics.insert(running.topics.begin(), running.topics.end());
  for (const std::string& topic : topics) {
    if (const std::vector<LatchedState::Entry>* entries = latched_.find(topic)) {
      for (const LatchedState::Entry& entry : *entries) {
        enqueue(entry.channel_index, running.behavior.begin, entry.bytes);
      }
    }
  }
}

std::int64_t Recorder::enclosing(const std::string& tree_path) const {
  const Behavior* deepest = nullptr;
  for (const auto& [id, running] : running_) {
    const Behavior& candidate = running.behavior;
    if (id > 0 && contains(candidate.tree_path, tree_path) &&
        (!deepest || candidate.tree_path.size() >= deepest->tree_path.size())) {
      deepest = &candidate;
    }
  }
  return deepest ? deepest->id : 0;
}

RecordedCounts Recorder::end(std::int64_t behavior_id, Stamp end, const std::string& outcome) {
  std::unique_lock<std::mutex> lock(mutex_);
  running(behavior_id).behavior.end = end;
  flush(lock);
  const RecordedCounts counts = countsOf(running(behavior_id));
  running_.erase(behavior_id);
  lock.unlock();
  replay::endBehavior(store_, behavior_id, end, outcome);
  return counts;
}

RecordedCounts Recorder::counts(std::int64_t behavior_id) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = running_.find(behavior_id);
  return found == running_.end() ? RecordedCounts{} : countsOf(found->second);
}

RecordedCounts Recorder::countsOf(const Running& running) const {
  RecordedCounts counts{running.stored, running.dropped, {}};
  std::set_difference(running.topics.begin(), running.topics.end(), running.heard.begin(),
                      running.heard.end(), std::back_inserter(counts.silent_topics));
  return counts;
}

Recorder::Running& Recorder::running(std::int64_t behavior_id) {
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

// -------------------------------------------------------------------------------------- writing

void Recorder::flush(std::unique_lock<std::mutex>& lock) {
  const std::uint64_t everything = next_sequence_;
  is_flushing_ = true;
  to_writer_.notify_one();
  from_writer_.wait(lock, [&] { return done_sequence_ >= everything; });
}

void Recorder::writeLoop() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    to_writer_.wait(lock, [this] { return is_closing_ || is_flushing_ || !queue_.empty(); });
    // Let a batch gather; a flush, the end or a queue half full do not wait.
    to_writer_.wait_for(lock, options_.batch_period, [this] {
      return is_closing_ || is_flushing_ || queued_bytes_ > options_.queue_bytes / 2;
    });
    is_flushing_ = false;
    write(lock, std::exchange(queue_, {}));
    if (is_closing_ && queue_.empty()) {
      return;
    }
  }
}

void Recorder::write(std::unique_lock<std::mutex>& lock, std::deque<Queued> batch) {
  if (!batch.empty()) {
    if (!failure_) {
      std::map<std::size_t, const Channel*> new_channels;
      for (const Queued& queued : batch) {
        if (store_channels_.count(queued.channel_index) == 0) {
          new_channels[queued.channel_index] = &channels_[queued.channel_index];
        }
      }
      std::optional<std::string> problem;
      lock.unlock();
      try {
        appendToStore(batch, new_channels);
      } catch (const std::exception& error) {
        problem = error.what();
      }
      lock.lock();
      failure_ = problem;
    }
    for (const Queued& queued : batch) {
      count(queued, failure_ ? &Running::dropped : &Running::stored);
      queued_bytes_ -= queued.size;
    }
    done_sequence_ = batch.back().message.sequence + 1;
  }
  from_writer_.notify_all();
}

void Recorder::appendToStore(std::deque<Queued>& batch,
                             const std::map<std::size_t, const Channel*>& new_channels) {
  for (const auto& [index, channel] : new_channels) {
    store_channels_[index] = {store_.addChannel(recording_, *channel), parse(*channel)};
  }
  std::vector<Message> messages;
  messages.reserve(batch.size());
  for (Queued& queued : batch) {
    const StoreChannel& channel = store_channels_.at(queued.channel_index);
    queued.message.channel = channel.id;
    queued.message.header_stamp = stampOf(channel.schema, queued.message.bytes);
    messages.push_back(std::move(queued.message));  // stamp and sequence stay, for the counts
  }
  store_.append(messages);
}

}  // namespace afterglow::replay
