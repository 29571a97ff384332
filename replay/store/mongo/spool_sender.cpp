#include "replay/store/mongo/spool_sender.hpp"

#include <algorithm>

#include "replay/store/mongo/mongo_store.hpp"
#include "replay/store/mongo/spool_entries.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kReservedIds = 1000;
constexpr std::int64_t kFewIds = 200;
constexpr std::size_t kSentAtOnce = 8 << 20;
/// An answer may be of the moment: so often the server is asked before it is taken for a refusal.
constexpr int kAttempts = 3;

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

SpoolSender::~SpoolSender() { finish(); }

void SpoolSender::finish() {
  if (!thread_.joinable()) return;
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
  server();  // throws while it cannot be opened, which is no entry's fault
  try {
    send(entries);
  } catch (const StoreAway&) {
    throw;
  } catch (const StoreBusy&) {
    throw;
  } catch (const std::exception&) {
    if (++refusals_ < kAttempts) throw;
    refusals_ = 0;
    sendAlone(entries.front());
    return true;
  }
  refusals_ = 0;
  spool_.confirm(entries);
  return true;
}

/// An entry that was refused, perhaps with others: message by message.
void SpoolSender::sendAlone(const Spool::Entry& entry) {
  std::vector<Message> refused;
  std::string why;
  const auto attempt = [&](const auto& work) {
    try {
      work();
      return true;
    } catch (const StoreAway&) {
      throw;
    } catch (const StoreBusy&) {
      throw;
    } catch (const std::exception& error) {
      why = error.what();
      return false;
    }
  };
  std::vector<Message> messages;
  const bool is_split = entry.kind == Spool::Kind::Messages &&
                        attempt([&] { messages = unpackMessages(entry.payload); });
  if (!is_split) {
    if (attempt([&] { send({entry}); })) return spool_.confirm({entry});
    return spool_.setAside(entry, entry.messages, entry.payload, nameOf(entry) + ": " + why);
  }
  for (const Message& message : messages) {
    Message there = message;
    const bool is_sent = attempt([&] {
      there.channel = channelOnServer(message.channel);
      server().append({there}, Duplicates::Skip);
    });
    if (!is_sent) refused.push_back(message);
  }
  if (refused.empty()) return spool_.confirm({entry});
  spool_.setAside(entry, refused.size(), packMessages(refused, 0, refused.size()),
                  nameOf(refused) + ": " + why);
}

std::string SpoolSender::nameOf(const std::vector<Message>& messages) const {
  const std::size_t count = messages.size();
  return std::to_string(count) + (count == 1 ? " message on " : " messages on ") +
         spool_.channel(messages.front().channel).topic;
}

/// One that is no message.
std::string SpoolSender::nameOf(const Spool::Entry& entry) {
  switch (entry.kind) {
    case Spool::Kind::Messages:
      return std::to_string(entry.messages) + " messages";
    case Spool::Kind::Behavior:
      return "a behavior";
    case Spool::Kind::Removal:
      return "the removal of a behavior";
    case Spool::Kind::File:
      return "a file";
  }
  return "";
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
