#include "replay/store/mongo/spool_sender.hpp"

#include <algorithm>

#include "replay/store/mongo/mongo_store.hpp"
#include "replay/store/mongo/spool_entries.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kReservedIds = 1000;
constexpr std::int64_t kFewIds = 200;
constexpr std::size_t kSentAtOnce = 8 << 20;

}  // namespace

SpoolSender::SpoolSender(Spool& spool, std::string uri, std::chrono::milliseconds farewell,
                         std::chrono::milliseconds pause)
    : spool_(spool), uri_(std::move(uri)), farewell_(farewell), pause_(pause) {
  try {
    reserveIds();
  } catch (const StoreError& error) {
    last_error_ = error.what();  // the server may come later
  }
  thread_ = std::thread([this] { run(); });
}

SpoolSender::~SpoolSender() {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    is_ending_ = true;
    changed_.notify_all();
    changed_.wait_for(lock, farewell_, [&] { return is_stopped_; });
    is_stopped_ = true;
    changed_.notify_all();
  }
  thread_.join();
}

MongoStore& SpoolSender::server() const {
  const std::lock_guard<std::mutex> lock(server_mutex_);
  if (!server_) server_ = std::make_unique<MongoStore>(uri_, OpenMode::Record);
  return *server_;
}

void SpoolSender::wake() {
  const std::lock_guard<std::mutex> lock(mutex_);
  has_news_ = true;
  changed_.notify_all();
}

std::string SpoolSender::lastError() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return last_error_;
}

void SpoolSender::reserveIds() {
  if (spool_.idsLeft() > kFewIds) return;
  spool_.giveIds(server().reserveBehaviorIds(kReservedIds), kReservedIds);
}

void SpoolSender::run() {
  auto pause = pause_;
  std::unique_lock<std::mutex> lock(mutex_);
  while (!is_stopped_) {
    has_news_ = false;
    lock.unlock();
    bool is_empty = false;
    std::string error;
    try {
      is_empty = !sendSome();
    } catch (const std::exception& failure) {
      error = failure.what();
    }
    lock.lock();
    last_error_ = error;
    if (!error.empty()) {
      changed_.wait_for(lock, pause, [&] { return is_stopped_; });
      pause = std::min(2 * pause, 32 * pause_);
      continue;
    }
    pause = pause_;
    if (is_empty && is_ending_ && !has_news_) break;
    if (is_empty) changed_.wait(lock, [&] { return has_news_ || is_ending_ || is_stopped_; });
  }
  is_stopped_ = true;
  changed_.notify_all();
}

/// False: nothing was left to send.
bool SpoolSender::sendSome() {
  const auto entries = spool_.front(kSentAtOnce);
  if (entries.empty()) return false;
  reserveIds();
  send(entries);
  spool_.confirm(entries);
  return true;
}

void SpoolSender::send(const std::vector<Spool::Entry>& entries) {
  const Bytes& payload = entries.front().payload;
  switch (entries.front().kind) {
    case Spool::Kind::Messages: {
      std::vector<Message> messages;
      for (const Spool::Entry& entry : entries) {
        for (Message& message : unpackMessages(entry.payload)) {
          message.channel = channelOnServer(message.channel);
          messages.push_back(std::move(message));
        }
      }
      return server().append(messages, Duplicates::Skip);
    }
    case Spool::Kind::Behavior:
      return sendBehavior(unpackBehavior(payload));
    case Spool::Kind::Removal: {
      const std::int64_t id = unpackId(payload);
      if (server().behavior(id)) server().removeBehavior(id);
      return;
    }
    case Spool::Kind::File: {
      const auto [sha256, contents] = unpackFile(payload);
      return server().addFile(sha256, contents);
    }
  }
}

void SpoolSender::sendBehavior(Behavior behavior) {
  const auto known = server().behavior(behavior.id);
  if (known && !behavior.key.empty() && known->key != behavior.key) {
    throw StoreError(serverName() + ": behavior " + std::to_string(behavior.id) +
                     " is another one there");
  }
  if (known) return server().updateBehavior(behavior);
  if (behavior.key.empty()) return;  // removed there meanwhile
  behavior.recording = recordingOnServer(behavior.recording);
  server().addBehavior(behavior);
}

std::int64_t SpoolSender::recordingOnServer(std::int64_t id) {
  const auto known = recordings_.find(id);
  if (known != recordings_.end()) return known->second;
  return recordings_[id] = server().addRecording(spool_.recording(id));
}

std::int64_t SpoolSender::channelOnServer(std::int64_t id) {
  const auto known = channels_.find(id);
  if (known != channels_.end()) return known->second;
  const std::int64_t recording = recordingOnServer(spool_.recordingOf(id));
  return channels_[id] = server().addChannel(recording, spool_.channel(id));
}

}  // namespace afterglow::replay
