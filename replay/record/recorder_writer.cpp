#include <algorithm>

#include "replay/messages/field_edit.hpp"
#include "replay/record/recorder.hpp"

namespace afterglow::replay {
namespace {

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
  References references;
  if (!batch.empty() && !failure_) {
    std::map<ChannelKey, const Channel*> new_channels;
    for (const Queued& queued : batch) {
      const ChannelKey key{queued.recording, queued.channel_index};
      if (store_channels_.count(key) == 0) {
        new_channels[key] = &channels_[queued.channel_index];
      }
    }
    std::optional<std::string> problem;
    lock.unlock();
    try {
      references = appendToStore(batch, new_channels);
    } catch (const std::exception& error) {
      problem = error.what();
    }
    lock.lock();
    failure_ = problem;
  }
  for (const Queued& queued : batch) {
    queued_bytes_ -= queued.size;
    if (failure_) {
      drop(queued);
      continue;
    }
    ++load_.messages;
    load_.bytes += queued.size - sizeof(Queued);
    const std::string& topic = channels_[queued.channel_index].topic;
    for (auto& [id, running] : running_) {
      if (running.isWithin(queued.message.received)) running.countStored(topic);
    }
  }
  for (const auto& [uri, places] : references) {
    for (auto& [id, running] : running_) {
      const bool refers = std::any_of(places.begin(), places.end(), [&](std::size_t place) {
        const Queued& queued = batch[place];
        return covers(running, channels_[queued.channel_index].topic, queued.message.received);
      });
      if (refers) running.refer(uri);
    }
  }
  done_ += batch.size();
  from_writer_.notify_all();
}

Recorder::References Recorder::appendToStore(
    std::deque<Queued>& batch, const std::map<ChannelKey, const Channel*>& new_channels) {
  for (const auto& [key, channel] : new_channels) {
    const std::optional<Schema> schema = parse(*channel);
    store_channels_[key] = {store_.addChannel(key.first, *channel), schema, referencesOf(schema)};
  }
  References references;
  std::vector<Message> messages;
  messages.reserve(batch.size());
  for (std::size_t i = 0; i < batch.size(); ++i) {
    Queued& queued = batch[i];
    const StoreChannel& channel = store_channels_.at({queued.recording, queued.channel_index});
    if (channel.references) {
      for (const std::string& uri : channel.references->find(queued.message.bytes)) {
        references[uri].insert(i);
      }
    }
    queued.message.channel = channel.id;
    queued.message.header_stamp = stampOf(channel.schema, queued.message.bytes);
    messages.push_back(std::move(queued.message));  // stamp and sequence stay, for the counts
  }
  store_.append(messages);
  return references;
}

}  // namespace afterglow::replay
