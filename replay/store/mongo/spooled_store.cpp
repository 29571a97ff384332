#include "replay/store/mongo/spooled_store.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

#include "replay/store/checksum.hpp"
#include "replay/store/mongo/mongo_open.hpp"
#include "replay/store/mongo/mongo_store.hpp"

namespace afterglow::replay {
namespace {

std::string defaultPath(const std::string& uri) {
  std::string folder;
  if (const char* named = std::getenv("AFTERGLOW_SPOOL"); named && *named) {
    folder = named;
  } else if (const std::string home = homeFolder(); !home.empty()) {
    folder = home + "/.local/share/afterglow";
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

std::unique_ptr<Store> openMongoStore(const std::string& uri, OpenMode mode) {
  if (mode == OpenMode::Record) return std::make_unique<SpooledStore>(uri, SpoolOptions{});
  return std::make_unique<MongoStore>(uri, mode);
}

SpooledStore::SpooledStore(const std::string& uri, const SpoolOptions& options)
    : path_(options.path.empty() ? defaultPath(uri) : options.path),
      spool_(path_, options.most_bytes),
      sender_(spool_, uri, options.farewell, options.pause) {}

// ---------------------------------------------------------------------------------------- writing

std::int64_t SpooledStore::addRecording(const Recording& recording) {
  return spool_.addRecording(recording);
}

std::int64_t SpooledStore::beginImport(const Recording&) { refuseImport(); }
void SpooledStore::finishImport(std::int64_t) { refuseImport(); }
void SpooledStore::dropRecording(std::int64_t) { refuseImport(); }
std::size_t SpooledStore::dropUnfinished() { return sender_.server().dropUnfinished(); }

std::int64_t SpooledStore::addChannel(std::int64_t recording, const Channel& channel) {
  return spool_.addChannel(recording, channel);
}

void SpooledStore::append(const std::vector<Message>& messages, Duplicates) {
  spool_.append(messages);
  sender_.wake();
}

std::int64_t SpooledStore::addBehavior(const Behavior& behavior) {
  checkObjects(behavior, sender_.serverName());
  spool_.recording(behavior.recording);
  Behavior stored = behavior;
  if (stored.key.empty()) stored.key = newKey();
  if (stored.id == 0) stored.id = spool_.takeBehaviorId();
  spool_.putBehavior(stored);
  sender_.wake();
  return stored.id;
}

void SpooledStore::updateBehavior(const Behavior& behavior) {
  checkObjects(behavior, sender_.serverName());
  Behavior stored = behavior;
  if (const auto spooled = spool_.behavior(behavior.id)) {
    stored.key = spooled->key;
    stored.recording = spooled->recording;
  } else {
    requireBehavior(behavior.id);
    stored.key.clear();
  }
  spool_.putBehavior(stored);
  sender_.wake();
}

void SpooledStore::removeBehavior(std::int64_t id) {
  requireBehavior(id);
  spool_.removeBehavior(id);
  sender_.wake();
}

void SpooledStore::requireBehavior(std::int64_t id) const {
  if (behavior(id)) return;
  throw StoreError(sender_.serverName() + ": there is no behavior " + std::to_string(id));
}

void SpooledStore::addFile(const std::string& sha256, const Bytes& contents) {
  spool_.addFile(sha256, contents);
  sender_.wake();
}

void SpooledStore::transaction(const std::function<void()>& work) { spool_.transaction(work); }

std::string SpooledStore::folder() const {
  return std::filesystem::absolute(path_).parent_path();
}

std::optional<SpoolStatus> SpooledStore::spoolStatus() const {
  SpoolStatus status = spool_.unsent();
  status.last_error = sender_.lastError();
  return status;
}

std::optional<SpoolStatus> SpooledStore::sendRest() {
  sender_.finish();
  return spoolStatus();
}

// ---------------------------------------------------------------------------------------- reading

std::optional<Behavior> SpooledStore::behavior(std::int64_t id) const {
  if (auto spooled = spool_.behavior(id)) return spooled;
  return sender_.server().behavior(id);
}

std::optional<Behavior> SpooledStore::behaviorOfKey(const std::string& key) const {
  if (auto spooled = spool_.behaviorOfKey(key)) return spooled;
  return sender_.server().behaviorOfKey(key);
}

Channel SpooledStore::channel(std::int64_t id) const { return spool_.channel(id); }

/// A behavior of the spool names its recording by the spool's id.
Behavior SpooledStore::asOnServer(const Behavior& behavior) const {
  if (!spool_.behavior(behavior.id)) return behavior;
  const auto there = sender_.server().behavior(behavior.id);
  if (!there) {
    throw StoreError(sender_.serverName() + ": behavior " + std::to_string(behavior.id) +
                     " is not there yet");
  }
  Behavior same = behavior;
  same.recording = there->recording;
  return same;
}

std::vector<Recording> SpooledStore::recordings() const { return sender_.server().recordings(); }

std::vector<Behavior> SpooledStore::behaviors(const BehaviorFilter& filter) const {
  return sender_.server().behaviors(filter);
}

std::vector<std::string> SpooledStore::explain(const BehaviorFilter& filter) const {
  return sender_.server().explain(filter);
}

std::vector<TopicSummary> SpooledStore::topics(const Behavior& behavior) const {
  return sender_.server().topics(asOnServer(behavior));
}

std::vector<TopicSummary> SpooledStore::contextTopics(const Behavior& behavior) const {
  return sender_.server().contextTopics(asOnServer(behavior));
}

std::unique_ptr<MessageCursor> SpooledStore::messages(const Behavior& behavior,
                                                      const MessageRange& range) const {
  return sender_.server().messages(asOnServer(behavior), range);
}

std::optional<Bytes> SpooledStore::file(const std::string& sha256) const {
  return sender_.server().file(sha256);
}

}  // namespace afterglow::replay
