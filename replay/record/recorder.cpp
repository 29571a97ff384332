#include "replay/record/recorder.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

/// Less is evened out: threads that take stamps at once and are held up, a disciplined clock.
constexpr std::int64_t kSetBack = 500'000'000;
constexpr std::size_t kMostNotices = 100;

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
    is_closing_ = is_hurried_ = true;
  }
  to_writer_.notify_all();
  from_writer_.notify_all();
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
      if (is_busy_) running.setReason("the store was busy for longer than there was room to wait");
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

}  // namespace afterglow::replay
