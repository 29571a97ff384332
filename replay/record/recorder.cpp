#include "replay/record/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "replay/messages/schema.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kMostNotices = 100;
constexpr std::size_t kMostSenders = 2000;

}  // namespace

Recorder::Recorder(Store& store, RecorderOptions options)
    : store_(store),
      options_(std::move(options)),
      recording_(store_.addRecording({0, "", options_.source, options_.robot})),
      past_(options_.pre_roll.count(), options_.pre_roll_bytes),
      running_(options_.context_topics),
      retry_([this](const std::string& why) {
        const std::lock_guard<std::mutex> lock(mutex_);
        notice(why + "; what arrives waits in the queue");
      }),
      writer_(store_, retry_, options_.queue_bytes, options_.batch_period,
              [this](const auto& batch, const auto& failure) { onWritten(batch, failure); }) {}

// ------------------------------------------------------------------------------------ coming in

std::size_t Recorder::channelIndex(Channel channel) {
  std::string why;
  try {
    why = mendDefinition(channel, options_.find_definition);
  } catch (const MessageError&) {
    // Its messages are kept as bytes.
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!why.empty()) mended_[channel.topic] = mendedText(channel, why);
  const auto known = std::find(channels_.begin(), channels_.end(), channel);
  if (known != channels_.end()) {
    return static_cast<std::size_t>(known - channels_.begin());
  }
  if (channels_.size() >= kMostSenders) {
    const auto other = std::find_if(channels_.begin(), channels_.end(), [&](Channel like) {
      like.caller_id = channel.caller_id;
      return like == channel;
    });
    if (other != channels_.end()) return static_cast<std::size_t>(other - channels_.begin());
  }
  channels_.push_back(channel);
  return channels_.size() - 1;
}

void Recorder::offer(std::size_t channel_index, Stamp received, Bytes bytes,
                     std::optional<std::int64_t> steady_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Channel& channel = channels_.at(channel_index);
  try {
    const Stamp stamp = stampOf(received, steady_ns);
    take(channel, {0, stamp, next_sequence_++, {}, std::move(bytes)});
  } catch (const std::bad_alloc&) {
    drop(channel.topic, clock_.last(), kNoMemory);
  }
}

void Recorder::take(const Channel& channel, Message message) {
  using Want = RunningBehaviors::Want;
  const Want want = running_.wants(channel.topic, message.received);
  if (want == Want::Yes) {
    if (channel.latching) {
      past_.push({&channel, message.received, message.sequence, true, message.bytes});
    }
    enqueue(channel, std::move(message));
  } else if (channel.latching || want == Want::No) {
    past_.push(
        {&channel, message.received, message.sequence, want != Want::No, std::move(message.bytes)});
  }
}

void Recorder::forgetLatched(const std::string& topic) {
  const std::lock_guard<std::mutex> lock(mutex_);
  past_.forget(topic);
}

void Recorder::look(const ClockReading& now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  stampOf(now.ros, now.is_simulated ? std::nullopt : std::optional(now.steady_ns));
  if (const std::optional<std::string> text = clock_.look(now)) {
    notice(*text);
  }
}

Stamp Recorder::stampOf(Stamp ros, std::optional<std::int64_t> steady_ns) {
  const RecordingClock::Given given = clock_.stamp(ros, !running_.empty(), steady_ns);
  if (given.jump) {
    past_.startAgain(given.stamp);
    notice(*given.jump);
  }
  return given.stamp;
}

void Recorder::notice(const std::string& text) {
  running_.remark(text);
  if (notices_.size() < kMostNotices) {
    notices_.push_back(text);
  }
}

std::vector<std::string> Recorder::takeNotices() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(notices_, {});
}

void Recorder::enqueue(const Channel& channel, Message message) {
  const Stamp received = message.received;
  const std::size_t size = message.bytes.size();
  QueuedMessage queued;
  queued.recording = recording_;
  queued.channel = &channel;
  queued.message = std::move(message);
  if (writer_.push(std::move(queued))) return;
  drop(channel.topic, received, whyNotTaken(size));
}

std::string Recorder::whyNotTaken(std::size_t message_bytes) const {
  if (const auto failed = writer_.failure()) return *failed;
  const auto megabytes = [](std::size_t bytes) {
    return fmt::format("{:.1f} MB", static_cast<double>(bytes) * 1e-6);
  };
  const std::string room = megabytes(options_.queue_bytes);
  const std::string way_out = "; recorder_node's ~queue_megabytes gives more room";
  if (message_bytes + sizeof(QueuedMessage) > options_.queue_bytes) {
    return "with " + megabytes(message_bytes) + " it is larger than the room of " + room +
           " for what waits for the store" + way_out;
  }
  if (retry_.isBusy()) {
    return "the store was busy for longer than the room of " + room + " lasted" + way_out;
  }
  return "they came faster than the store could write, and the room of " + room +
         " for what waits was full" + way_out;
}

// --------------------------------------------------------------------------------------- counts

void Recorder::drop(const std::string& topic, Stamp received, const std::string& why) {
  ++load_.dropped;
  running_.forCovering(topic, received,
                       [&](RunningBehavior& running) { running.countDropped(topic, why); });
}

void Recorder::onWritten(const std::deque<QueuedMessage>& batch,
                         const std::optional<std::string>& failure) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const QueuedMessage& queued : batch) {
    if (failure) {
      drop(queued.channel->topic, queued.message.received, *failure);
    } else {
      count(queued);
    }
  }
}

void Recorder::count(const QueuedMessage& written) {
  const std::string& topic = written.channel->topic;
  if (written.refusal) {
    ++load_.dropped;
  } else {
    ++load_.messages;
    load_.bytes += written.size - sizeof(QueuedMessage);
  }
  running_.forCovering(topic, written.message.received, [&](RunningBehavior& running) {
    if (written.refusal) {
      running.countRefused(topic, *written.refusal);
    } else {
      running.countStored(topic, written.message.received);
    }
    if (written.is_unfit) running.countUnfit(topic);
    for (const std::string& uri : written.files) running.refer(uri);
  });
}

RecordedCounts Recorder::counts(std::int64_t behavior_id) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const RunningBehavior* running = running_.find(behavior_id);
  return running ? running->counts() : RecordedCounts{};
}

RecorderLoad Recorder::load() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  RecorderLoad load = load_;
  load.queued_bytes = writer_.queuedBytes();
  return load;
}

std::optional<std::string> Recorder::failure() const { return writer_.failure(); }

void Recorder::hurry() { retry_.hurry(); }

// ------------------------------------------------------------------------------------ behaviors

Behavior Recorder::begin(Behavior behavior, const RecordingTerms& terms) {
  const std::lock_guard<std::mutex> row(rows_mutex_);  // a discard would not spare it before
  writeUnended();
  const std::optional<std::string> failed_before = failure();
  // Its messages are kept from here on; the store is asked without holding up those who offer.
  const std::int64_t provisional = admit(behavior, terms);
  try {
    behavior.id = store_.addBehavior(behavior);
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    retire(provisional);
    if (failed_before) writer_.fail(*failed_before);
    throw;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  running_.rename(provisional, behavior.id);
  return behavior;
}

std::int64_t Recorder::admit(Behavior& behavior, const RecordingTerms& terms) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::optional<std::string> failed = failure();
  if (failed && !running_.empty()) throw StoreError(*failed);
  const Stamp now = stampOf(behavior.begin);
  // A behavior that was cut off reaches to the end of its recording.
  if ((clock_.wentBack() || failed) && running_.empty()) {
    recording_ = store_.addRecording({0, "", options_.source, options_.robot});
    clock_.beginRecording();
  }
  writer_.resume();  // the disk may have room again
  behavior.recording = recording_;
  behavior.end.reset();
  behavior.begin = past_.reach(now, terms.pre_roll_ns);
  behavior.wall_begin.ns -= now.ns - behavior.begin.ns;
  if (behavior.robot.empty()) {
    behavior.robot = options_.robot;
  }
  const std::int64_t provisional = running_.add(behavior, terms.limits);
  enqueuePast(running_.at(provisional));
  return provisional;
}

void Recorder::enqueuePast(const RunningBehavior& running) {
  const Stamp begin = running.behavior().begin;
  const std::set<std::string> topics = running_.topicsOf(running);
  for (LatchedState::Entry& entry : past_.latchedAt(begin, topics)) {
    enqueue(*entry.channel, {0, begin, next_sequence_++, {}, std::move(entry.bytes)});
  }
  enqueueEarlierTransforms(begin, topics);
  for (PreRoll::Entry& entry : past_.take(begin, topics)) {
    const bool is_wanted = running_.wants(entry.channel->topic, entry.received) ==
                           RunningBehaviors::Want::Yes;
    if (!is_wanted) continue;
    enqueue(*entry.channel, {0, entry.received, entry.sequence, {}, std::move(entry.bytes)});
  }
}

/// Enqueues transforms from before the begin: a picture that a camera took just before it arrives
/// after it, and its transforms are older. They stand in the recording before the behavior, where
/// those who replay it look for them.
void Recorder::enqueueEarlierTransforms(Stamp begin, const std::set<std::string>& topics) {
  if (topics.count(kTransforms) == 0) return;
  for (PreRoll::Entry& entry : past_.take({begin.ns - kTransformsBefore_ns}, {kTransforms})) {
    const bool is_wanted =
        entry.received < begin ||
        running_.wants(kTransforms, entry.received) == RunningBehaviors::Want::Yes;
    if (!is_wanted) continue;
    enqueue(*entry.channel, {0, entry.received, entry.sequence, {}, std::move(entry.bytes)});
  }
}

void Recorder::addTopics(std::int64_t behavior_id, const std::vector<std::string>& topics) {
  const std::lock_guard<std::mutex> row(rows_mutex_);
  std::unique_lock<std::mutex> lock(mutex_);
  RunningBehavior& running = running_.at(behavior_id);
  for (const std::string& topic : topics) {
    running.addTopic(topic);
  }
  const Behavior changed = running.behavior();
  lock.unlock();
  try {
    store_.updateBehavior(changed);
  } catch (const StoreBusy&) {
    // Its end writes them; until then they are only missing should the recorder die.
  }
}

RecordedCounts Recorder::end(std::int64_t behavior_id, Stamp end, const Completion& complete) {
  std::unique_lock<std::mutex> lock(mutex_);
  RunningBehavior& running = running_.at(behavior_id);
  // Behind the last stamp given, even if the clock stands still.
  const Stamp behind_last{clock_.last().ns + 1};
  running.setEnd(std::max(stampOf(end), behind_last));
  for (const auto& [topic, remark] : mended_) {
    if (running.isOwn(topic)) running.remark(remark);
  }
  lock.unlock();
  writer_.flush();
  lock.lock();
  RunningBehavior ended = running_.at(behavior_id);
  retire(behavior_id);
  lock.unlock();
  if (failure()) ended.cutShort();
  Behavior behavior = ended.written();
  bool is_complete = false;
  try {
    retry_.insist([&] {
      if (!is_complete) {
        Behavior completed = behavior;  // anew each time
        complete(completed, ended.references());
        behavior = std::move(completed);
        is_complete = true;
      }
      const std::lock_guard<std::mutex> row(rows_mutex_);
      store_.updateBehavior(behavior);
    });
  } catch (const std::exception& error) {
    if (behavior.outcome.empty()) behavior.outcome = kIncomplete;
    behavior.remarks.push_back(error.what());
    lock.lock();
    unended_.push_back(std::move(behavior));
    throw;
  }
  return ended.counts();
}

void Recorder::writeUnended() {
  std::unique_lock<std::mutex> lock(mutex_);
  std::vector<Behavior> unended = std::exchange(unended_, {});
  lock.unlock();
  for (Behavior& behavior : unended) {
    try {
      store_.updateBehavior(behavior);
    } catch (const std::exception&) {
      lock.lock();
      unended_.push_back(std::move(behavior));  // for the next time
      lock.unlock();
    }
  }
}

void Recorder::discard(std::int64_t behavior_id) {
  retry_.insist([&] {
    const std::lock_guard<std::mutex> row(rows_mutex_);
    store_.removeBehavior(behavior_id);
  });
  const std::lock_guard<std::mutex> lock(mutex_);
  past_.limitReach(clock_.last());
}

void Recorder::retire(std::int64_t behavior_id) {
  running_.remove(behavior_id);
  if (running_.empty() && clock_.endRecording()) {
    past_.startAgain(clock_.last());
  }
}

}  // namespace afterglow::replay
