#include "replay/store/mongo/spooled_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "replay/store/checksum.hpp"
#include "replay/store/mongo/mongo_store.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kReservedIds = 1000;
constexpr std::int64_t kFewIds = 200;
constexpr std::size_t kSentAtOnce = 8 << 20;

std::string defaultPath(const std::string& uri) {
  std::string folder;
  if (const char* named = std::getenv("AFTERGLOW_SPOOL"); named && *named) {
    folder = named;
  } else if (const char* home = std::getenv("HOME"); home && *home) {
    folder = std::string(home) + "/.local/share/afterglow";
  } else {
    throw StoreError("no place for the spool: neither AFTERGLOW_SPOOL nor HOME is set");
  }
  const std::string name = storeUri(uri);  // without password and options, which may change
  const auto hash = checksumOf(reinterpret_cast<const std::uint8_t*>(name.data()), name.size());
  return fmt::format("{}/spool-{:016x}.db", folder, static_cast<std::uint64_t>(hash));
}

[[noreturn]] void refuseImport() {
  throw StoreError("a recorder's store on a server imports nothing; open it for writing");
}

}  // namespace

SpooledStore::SpooledStore(const std::string& uri, SpoolOptions options)
    : uri_(uri),
      options_(std::move(options)),
      spool_(options_.path.empty() ? defaultPath(uri) : options_.path, options_.most_bytes) {
  try {
    reserveIds();
  } catch (const StoreError& error) {
    last_error_ = error.what();  // the server may come later
  }
  sender_ = std::thread([this] { run(); });
}

SpooledStore::~SpooledStore() {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    is_ending_ = true;
    changed_.notify_all();
    changed_.wait_for(lock, options_.farewell, [&] { return is_stopped_; });
    is_stopped_ = true;
    changed_.notify_all();
  }
  sender_.join();
}

// ---------------------------------------------------------------------------------------- writing

void SpooledStore::wake() {
  const std::lock_guard<std::mutex> lock(mutex_);
  has_news_ = true;
  changed_.notify_all();
}

std::int64_t SpooledStore::addRecording(const Recording& recording) {
  return spool_.addRecording(recording);
}

std::int64_t SpooledStore::beginImport(const Recording&) { refuseImport(); }
void SpooledStore::finishImport(std::int64_t) { refuseImport(); }
void SpooledStore::dropRecording(std::int64_t) { refuseImport(); }
std::size_t SpooledStore::dropUnfinished() { return server().dropUnfinished(); }

std::int64_t SpooledStore::addChannel(std::int64_t recording, const Channel& channel) {
  return spool_.addChannel(recording, channel);
}

void SpooledStore::append(const std::vector<Message>& messages, Duplicates) {
  spool_.append(messages);
  wake();
}

void SpooledStore::checkBehavior(const Behavior& behavior) const {
  for (const auto& [what, text] : {std::pair("parameters", &behavior.parameters),
                                   std::pair("calibration", &behavior.calibration),
                                   std::pair("snapshot", &behavior.snapshot)}) {
    if (!nlohmann::json::parse(*text, nullptr, false).is_object()) {
      throw StoreError(storeUri(uri_) + ": " + what + " of behavior \"" + behavior.name +
                       "\": no JSON object");
    }
  }
}

std::int64_t SpooledStore::addBehavior(const Behavior& behavior) {
  checkBehavior(behavior);
  spool_.recording(behavior.recording);
  Behavior stored = behavior;
  if (stored.key.empty()) stored.key = newKey();
  if (stored.id == 0) stored.id = spool_.takeBehaviorId();
  spool_.putBehavior(stored);
  wake();
  return stored.id;
}

void SpooledStore::updateBehavior(const Behavior& behavior) {
  checkBehavior(behavior);
  Behavior stored = behavior;
  if (const auto spooled = spool_.behavior(behavior.id)) {
    stored.key = spooled->key;
    stored.recording = spooled->recording;
  } else if (server().behavior(behavior.id)) {
    stored.key.clear();
  } else {
    throw StoreError(storeUri(uri_) + ": there is no behavior " + std::to_string(behavior.id));
  }
  spool_.putBehavior(stored);
  wake();
}

void SpooledStore::removeBehavior(std::int64_t id) {
  if (!behavior(id)) {
    throw StoreError(storeUri(uri_) + ": there is no behavior " + std::to_string(id));
  }
  spool_.removeBehavior(id);
  wake();
}

void SpooledStore::addFile(const std::string& sha256, const Bytes& contents) {
  spool_.addFile(sha256, contents);
  wake();
}

void SpooledStore::transaction(const std::function<void()>& work) { spool_.transaction(work); }

// ---------------------------------------------------------------------------------------- sending

MongoStore& SpooledStore::server() const {
  const std::lock_guard<std::mutex> lock(server_mutex_);
  if (!server_) server_ = std::make_unique<MongoStore>(uri_, OpenMode::Record);
  return *server_;
}

void SpooledStore::reserveIds() {
  if (spool_.idsLeft() > kFewIds) return;
  spool_.giveIds(server().reserveBehaviorIds(kReservedIds), kReservedIds);
}

void SpooledStore::run() {
  auto pause = options_.pause;
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
      pause = std::min(2 * pause, 32 * options_.pause);
      continue;
    }
    pause = options_.pause;
    if (is_empty && is_ending_ && !has_news_) break;
    if (is_empty) changed_.wait(lock, [&] { return has_news_ || is_ending_ || is_stopped_; });
  }
  is_stopped_ = true;
  changed_.notify_all();
}

/// False: nothing was left to send.
bool SpooledStore::sendSome() {
  const auto entries = spool_.front(kSentAtOnce);
  if (entries.empty()) return false;
  reserveIds();
  send(entries);
  spool_.confirm(entries);
  return true;
}

void SpooledStore::send(const std::vector<Spool::Entry>& entries) {
  const Bytes& payload = entries.front().payload;
  switch (entries.front().kind) {
    case Spool::Kind::Messages: {
      std::vector<Message> messages;
      for (const Spool::Entry& entry : entries) {
        for (Message& message : Spool::unpack(entry.payload)) {
          message.channel = channelOnServer(message.channel);
          messages.push_back(std::move(message));
        }
      }
      return server().append(messages, Duplicates::Skip);
    }
    case Spool::Kind::Behavior:
      return sendBehavior(Spool::behaviorIn(payload));
    case Spool::Kind::Removal: {
      const std::int64_t id = Spool::idIn(payload);
      if (server().behavior(id)) server().removeBehavior(id);
      return;
    }
    case Spool::Kind::File: {
      const auto [sha256, contents] = Spool::fileIn(payload);
      return server().addFile(sha256, contents);
    }
  }
}

void SpooledStore::sendBehavior(Behavior behavior) {
  const auto known = server().behavior(behavior.id);
  if (known && !behavior.key.empty() && known->key != behavior.key) {
    throw StoreError(storeUri(uri_) + ": behavior " + std::to_string(behavior.id) +
                     " is another one there");
  }
  if (known) return server().updateBehavior(behavior);
  if (behavior.key.empty()) return;  // removed there meanwhile
  behavior.recording = recordingOnServer(behavior.recording);
  server().addBehavior(behavior);
}

std::int64_t SpooledStore::recordingOnServer(std::int64_t id) {
  const auto known = recordings_on_server_.find(id);
  if (known != recordings_on_server_.end()) return known->second;
  return recordings_on_server_[id] = server().addRecording(spool_.recording(id));
}

std::int64_t SpooledStore::channelOnServer(std::int64_t id) {
  const auto known = channels_on_server_.find(id);
  if (known != channels_on_server_.end()) return known->second;
  const std::int64_t recording = recordingOnServer(spool_.recordingOf(id));
  return channels_on_server_[id] = server().addChannel(recording, spool_.channel(id));
}

SpoolStatus SpooledStore::spoolStatus() const {
  SpoolStatus status{spool_.unsentMessages(), spool_.unsentBytes(), ""};
  const std::lock_guard<std::mutex> lock(mutex_);
  status.last_error = last_error_;
  return status;
}

// ---------------------------------------------------------------------------------------- reading

std::optional<Behavior> SpooledStore::behavior(std::int64_t id) const {
  if (auto spooled = spool_.behavior(id)) return spooled;
  return server().behavior(id);
}

std::optional<Behavior> SpooledStore::behaviorOfKey(const std::string& key) const {
  if (auto spooled = spool_.behaviorOfKey(key)) return spooled;
  return server().behaviorOfKey(key);
}

Channel SpooledStore::channel(std::int64_t id) const { return spool_.channel(id); }

/// A behavior of the spool names its recording by the spool's id.
Behavior SpooledStore::asOnServer(const Behavior& behavior) const {
  if (!spool_.behavior(behavior.id)) return behavior;
  const auto there = server().behavior(behavior.id);
  if (!there) {
    throw StoreError(storeUri(uri_) + ": behavior " + std::to_string(behavior.id) +
                     " is not there yet");
  }
  Behavior same = behavior;
  same.recording = there->recording;
  return same;
}

std::vector<Recording> SpooledStore::recordings() const { return server().recordings(); }

std::vector<Behavior> SpooledStore::behaviors(const BehaviorFilter& filter) const {
  return server().behaviors(filter);
}

std::vector<std::string> SpooledStore::explain(const BehaviorFilter& filter) const {
  return server().explain(filter);
}

std::vector<TopicSummary> SpooledStore::topics(const Behavior& behavior) const {
  return server().topics(asOnServer(behavior));
}

std::vector<TopicSummary> SpooledStore::contextTopics(const Behavior& behavior) const {
  return server().contextTopics(asOnServer(behavior));
}

std::unique_ptr<MessageCursor> SpooledStore::messages(const Behavior& behavior,
                                                      const MessageRange& range) const {
  return server().messages(asOnServer(behavior), range);
}

std::optional<Bytes> SpooledStore::file(const std::string& sha256) const {
  return server().file(sha256);
}

}  // namespace afterglow::replay
