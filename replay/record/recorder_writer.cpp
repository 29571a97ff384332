#include "replay/messages/field_edit.hpp"
#include "replay/record/recorder.hpp"

namespace afterglow::replay {
namespace {

/// The store has waited itself before it says that it is busy.
constexpr std::chrono::milliseconds kBusyPause{100};

/// A definition nobody understands is recorded all the same, as bytes.
std::optional<Schema> parse(const Channel& channel) {
  try {
    return Schema::parse(channel.type, channel.definition);
  } catch (const MessageError&) {
    return std::nullopt;
  }
}

std::shared_ptr<const FileReferences> referencesOf(const std::optional<Schema>& schema) {
  if (!schema) {
    return nullptr;
  }
  auto references = std::make_shared<const FileReferences>(*schema);
  return references->any() ? references : nullptr;
}

std::optional<Stamp> stampOf(const std::optional<Schema>& schema, const Bytes& bytes) {
  try {
    return schema ? headerStamp(*schema, bytes) : std::nullopt;
  } catch (const MessageError&) {
    return std::nullopt;  // bytes that do not fit their type are evidence, too
  }
}

}  // namespace

void Recorder::flush(std::unique_lock<std::mutex>& lock) {
  const std::uint64_t everything = enqueued_;
  is_flushing_ = true;
  to_writer_.notify_one();
  from_writer_.wait(lock, [&] { return done_ >= everything; });
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
  Batch seen;
  if (!batch.empty() && !failure_) {
    const auto new_channels = newChannels(batch);
    std::optional<std::string> problem;
    lock.unlock();
    try {
      insist([&] { addChannels(new_channels); });
      seen = lookAt(batch);
      appendToStore(seen);
    } catch (const std::exception& error) {
      problem = error.what();
    }
    lock.lock();
    if (problem) failure_ = problem;
  }
  for (const Queued& queued : batch) queued_bytes_ -= queued.size;
  if (failure_) {
    for (const Queued& queued : batch) drop(queued);
  } else {
    count(batch, seen);
  }
  done_ += batch.size();
  from_writer_.notify_all();
}

std::map<Recorder::ChannelKey, const Channel*> Recorder::newChannels(
    const std::deque<Queued>& batch) const {
  std::map<ChannelKey, const Channel*> found;
  for (const Queued& queued : batch) {
    const ChannelKey key{queued.recording, queued.channel_index};
    if (store_channels_.count(key) == 0) found[key] = &channels_[queued.channel_index];
  }
  return found;
}

void Recorder::addChannels(const std::map<ChannelKey, const Channel*>& new_channels) {
  for (const auto& [key, channel] : new_channels) {
    if (store_channels_.count(key) != 0) continue;
    const std::optional<Schema> schema = parse(*channel);
    store_channels_[key] = {store_.addChannel(key.first, *channel), schema, referencesOf(schema)};
  }
}

/// Whatever a single message is like, it ends no recording.
Recorder::Batch Recorder::lookAt(std::deque<Queued>& batch) const {
  Batch seen;
  seen.messages.reserve(batch.size());
  for (std::size_t i = 0; i < batch.size(); ++i) {
    Queued& queued = batch[i];
    const StoreChannel& channel = store_channels_.at({queued.recording, queued.channel_index});
    const Bytes& bytes = queued.message.bytes;
    try {
      if (channel.schema && !fits(*channel.schema, bytes)) seen.unfit.insert(i);
      if (channel.references) {
        for (const std::string& uri : channel.references->find(bytes)) {
          seen.references[uri].insert(i);
        }
      }
    } catch (const std::exception&) {
      seen.unfit.insert(i);
    }
    queued.message.channel = channel.id;
    queued.message.header_stamp = stampOf(channel.schema, bytes);
    seen.messages.push_back(std::move(queued.message));  // stamp and sequence stay, for the counts
    seen.places.push_back(i);
  }
  return seen;
}

void Recorder::appendToStore(Batch& batch) {
  for (;;) {
    try {
      return insist([&] { store_.append(batch.messages); });
    } catch (const MessageRefused& refusal) {
      const auto at = static_cast<std::ptrdiff_t>(refusal.place());
      batch.refused[batch.places.at(refusal.place())] = refusal.what();
      batch.messages.erase(batch.messages.begin() + at);
      batch.places.erase(batch.places.begin() + at);
    }
  }
}

void Recorder::count(const std::deque<Queued>& batch, const Batch& seen) {
  const auto forCovering = [&](std::size_t place, const auto& work) {
    const std::string& topic = channels_[batch[place].channel_index].topic;
    for (auto& [id, running] : running_) {
      if (covers(running, topic, batch[place].message.received)) work(running, topic);
    }
  };
  for (std::size_t i = 0; i < batch.size(); ++i) {
    if (seen.refused.count(i) != 0) continue;
    ++load_.messages;
    load_.bytes += batch[i].size - sizeof(Queued);
    forCovering(i, [](RunningBehavior& running, const auto& topic) { running.countStored(topic); });
  }
  for (const auto& [place, why] : seen.refused) {
    ++load_.dropped;
    forCovering(place, [why = &why](RunningBehavior& running, const auto& topic) {
      running.countRefused(topic, *why);
    });
  }
  for (const std::size_t place : seen.unfit) {
    forCovering(place,
                [](RunningBehavior& running, const auto& topic) { running.countUnfit(topic); });
  }
  for (const auto& [uri, places] : seen.references) {
    for (const std::size_t place : places) {
      forCovering(place, [uri = &uri](RunningBehavior& running, const auto&) {
        running.refer(*uri);
      });
    }
  }
}

void Recorder::insist(const std::function<void()>& work) {
  for (;;) {
    try {
      work();
      break;
    } catch (const StoreBusy& busy) {
      if (!waitForStore(busy.what())) throw;
    }
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  is_busy_ = false;
}

/// False: there is no time.
bool Recorder::waitForStore(const std::string& why_busy) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (!std::exchange(is_busy_, true)) notice(why_busy + "; what arrives waits in the queue");
  from_writer_.wait_for(lock, kBusyPause, [this] { return is_hurried_; });
  return !is_hurried_;
}

}  // namespace afterglow::replay
