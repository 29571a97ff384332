#include "replay/store/mongo/mongo_store.hpp"

#include <limits>

#include "replay/store/mongo/mongo_open.hpp"
#include "replay/store/mongo/mongo_query.hpp"

namespace afterglow::replay {
namespace {

Bson set(const char* field, std::int64_t value) {
  return Bson().add("$set", Bson().add(field, value));
}

}  // namespace

std::unique_ptr<Store> openMongoStore(const std::string& uri, OpenMode mode) {
  return std::make_unique<MongoStore>(uri, mode);
}

MongoStore::MongoStore(const std::string& uri, OpenMode mode)
    : client_(uri, std::chrono::seconds(mode == OpenMode::Record ? 10 : 60)),
      rest_(client_.database() + "_afterglow"),
      is_read_only_(mode == OpenMode::ReadOnly),
      catalog_(client_, rest_, undo_),
      blobs_(client_, rest_),
      messages_(client_, catalog_, blobs_, undo_) {
  prepare(mode);
}

void MongoStore::prepare(OpenMode mode) {
  const Bson format = Bson().add("_id", "format");
  if (const auto found = client_.findOne(rest_, "store", format)) {
    const std::int64_t version = integerAt(found->raw(), "version").value_or(0);
    if (version > kMongoVersion) {
      throw StoreError(client_.name() + ": the store has version " + std::to_string(version) +
                       ", this program knows up to " + std::to_string(kMongoVersion));
    }
    return;
  }
  if (mode == OpenMode::ReadOnly) throw StoreError(client_.name() + ": no such store");
  catalog_.makeIndexes();
  client_.makeIndex(rest_, "behaviors", {"key"}, true);
  client_.makeIndex(rest_, "behaviors", {"begin_ns"});
  client_.makeIndex(rest_, "behaviors", {"name", "begin_ns"});
  client_.makeIndex(rest_, "behaviors", {"recording"});
  blobs_.makeIndexes();
  client_.upsert(rest_, "store", Bson(format).add("version", kMongoVersion));
}

MongoStore::Lock MongoStore::lockToWrite() {
  Lock lock(write_mutex_);
  if (is_read_only_) client_.fail("write", "the store was opened for reading");
  return lock;
}

void MongoStore::transaction(const std::function<void()>& work) {
  const Lock lock(write_mutex_);
  undo_.transaction(work);
}

// ------------------------------------------------------- recordings, channels, messages and files

std::int64_t MongoStore::addRecording(const Recording& recording) {
  const Lock lock = lockToWrite();
  return catalog_.addRecording(recording);
}

std::int64_t MongoStore::beginImport(const Recording& recording) {
  const Lock lock = lockToWrite();
  Recording fresh = recording;
  fresh.key.clear();
  const std::int64_t id = catalog_.addRecording(fresh);
  catalog_.beginImport(id);
  return id;
}

void MongoStore::finishImport(std::int64_t recording) {
  const Lock lock = lockToWrite();
  catalog_.finishImport(recording);
}

void MongoStore::dropRecording(std::int64_t recording) {
  const Lock lock = lockToWrite();
  if (client_.findOne(rest_, "behaviors", Bson().add("recording", recording))) {
    client_.fail("drop recording " + std::to_string(recording), "it has behaviors");
  }
  Behavior all;
  all.recording = recording;
  all.begin = Stamp{std::numeric_limits<std::int64_t>::min()};
  messages_.remove(all, {});
  catalog_.removeRecording(recording);
}

std::size_t MongoStore::dropUnfinished() {
  const std::vector<std::int64_t> dead = catalog_.deadImports();
  for (const std::int64_t recording : dead) dropRecording(recording);
  return dead.size();
}

std::int64_t MongoStore::addChannel(std::int64_t recording, const Channel& channel) {
  const Lock lock = lockToWrite();
  messages_.requireNameable(channel.topic);
  return catalog_.addChannel(recording, channel);
}

void MongoStore::append(const std::vector<Message>& messages, Duplicates duplicates) {
  const Lock lock = lockToWrite();
  if (!messages.empty()) catalog_.renewImport(messages.front().channel);
  messages_.append(messages, duplicates);
}

void MongoStore::addFile(const std::string& sha256, const Bytes& contents) {
  const Lock lock = lockToWrite();
  if (blobs_.contains(sha256)) return;
  blobs_.put(sha256, contents);
  undo_.onFailure([this, sha256] { blobs_.remove(sha256); });
}

std::optional<Bytes> MongoStore::file(const std::string& sha256) const {
  return blobs_.get(sha256);
}

std::vector<Recording> MongoStore::recordings() const { return catalog_.recordings(); }

Channel MongoStore::channel(std::int64_t id) const { return catalog_.channel(id)->channel; }

std::vector<TopicSummary> MongoStore::topics(const Behavior& behavior) const {
  return messages_.summaries(behavior, true);
}

std::vector<TopicSummary> MongoStore::contextTopics(const Behavior& behavior) const {
  return messages_.summaries(behavior, false);
}

std::unique_ptr<MessageCursor> MongoStore::messages(const Behavior& behavior,
                                                    const MessageRange& range) const {
  return std::make_unique<MongoCursor>(messages_, behavior, range);
}

// -------------------------------------------------------------------------------------- behaviors

std::int64_t MongoStore::addBehavior(const Behavior& behavior) {
  const Lock lock = lockToWrite();
  catalog_.recording(behavior.recording);  // throws if it is unknown
  checkObjects(behavior, client_.name());
  Behavior stored = behavior;
  if (stored.key.empty()) stored.key = newKey();
  if (stored.id == 0) stored.id = client_.takeNumber(rest_, "behaviors");
  const MongoWrite write = client_.insert(rest_, "behaviors", {toMongo(stored)});
  if (!write.refused.empty()) client_.fail("add a behavior", write.why);
  if (!write.duplicates.empty()) {
    client_.fail("add behavior " + std::to_string(stored.id),
                 "its id or its key " + stored.key + " is there already");
  }
  undo_.onFailure([this, id = stored.id] { client_.remove(rest_, "behaviors", withId(id)); });
  return stored.id;
}

void MongoStore::updateBehavior(const Behavior& behavior) {
  const Lock lock = lockToWrite();
  const Behavior before = requireBehavior(behavior.id);
  checkObjects(behavior, client_.name());
  Behavior after = behavior;
  after.key = before.key;
  after.recording = before.recording;
  client_.upsert(rest_, "behaviors", toMongo(after));
  undo_.onFailure([this, before] { client_.upsert(rest_, "behaviors", toMongo(before)); });
}

void MongoStore::removeBehavior(std::int64_t id) {
  const Lock lock = lockToWrite();
  const Behavior removed = requireBehavior(id);
  std::vector<std::int64_t> children;
  client_.find(rest_, "behaviors", Bson().add("parent", id), {}, [&](const bson_t& child) {
    children.push_back(integerAt(child, "_id").value_or(0));
    return true;
  });
  client_.remove(rest_, "behaviors", withId(id));
  client_.update(rest_, "behaviors", Bson().add("parent", id), set("parent", removed.parent));
  undo_.onFailure([this, removed, children] {
    client_.upsert(rest_, "behaviors", toMongo(removed));
    const Bson which = Bson().add("_id", Bson().add("$in", children));
    client_.update(rest_, "behaviors", which, set("parent", removed.id));
  });
  undo_.onSuccess([this, removed] { removeUncovered(removed); });
}

void MongoStore::removeUncovered(const Behavior& removed) const {
  std::vector<Behavior> others;
  client_.find(rest_, "behaviors", Bson().add("recording", removed.recording), {},
               [&](const bson_t& document) {
                 others.push_back(behaviorFromMongo(document));
                 return true;
               });
  messages_.remove(removed, others);
}

std::optional<Behavior> MongoStore::findBehavior(const Bson& query) const {
  const auto found = client_.findOne(rest_, "behaviors", query);
  if (!found) return std::nullopt;
  return behaviorFromMongo(found->raw());
}

Behavior MongoStore::requireBehavior(std::int64_t id) const {
  auto found = behavior(id);
  if (!found) throw StoreError(client_.name() + ": there is no behavior " + std::to_string(id));
  return std::move(*found);
}

std::optional<Behavior> MongoStore::behavior(std::int64_t id) const {
  return findBehavior(withId(id));
}

std::optional<Behavior> MongoStore::behaviorOfKey(const std::string& key) const {
  return findBehavior(Bson().add("key", key));
}

std::vector<Behavior> MongoStore::behaviors(const BehaviorFilter& filter) const {
  return MongoQuery(client_, rest_, messages_, filter).run();
}

std::vector<std::string> MongoStore::explain(const BehaviorFilter& filter) const {
  return MongoQuery(client_, rest_, messages_, filter).explain();
}

}  // namespace afterglow::replay
