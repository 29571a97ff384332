#include "replay/store/mongo/mongo_catalog.hpp"

#include <iterator>

#include "replay/store/checksum.hpp"

namespace afterglow::replay {
namespace {

/// The lease of an import; clocks of a fleet may differ by much less.
constexpr std::chrono::hours kLease{1};
constexpr std::chrono::minutes kRenewal{1};

Recording recordingFrom(const bson_t& document) {
  return {integerAt(document, "_id").value_or(0), textAt(document, "key").value_or(""),
          textAt(document, "source").value_or(""), textAt(document, "robot").value_or("")};
}

/// Copies a value that is remembered; empty if it is not.
template <typename Value>
std::optional<Value> remembered(std::mutex& mutex, const std::map<std::int64_t, Value>& values,
                                std::int64_t id) {
  const std::lock_guard<std::mutex> lock(mutex);
  const auto known = values.find(id);
  return known == values.end() ? std::nullopt : std::optional<Value>(known->second);
}

}  // namespace

void MongoCatalog::makeIndexes() const {
  client_.makeIndex(database_, "recordings", {"key"}, true);
  client_.makeIndex(database_, "channels",
                    {"recording", "topic", "definition", "latching", "caller_id"}, true);
}

// ---------------------------------------------------------------------------------------- writing

/// The number of the document that begins with `key`, made with `rest` behind it on first sight.
std::int64_t MongoCatalog::findOrInsert(const std::string& collection, const Bson& key,
                                        const Bson& rest) {
  for (;;) {
    if (const auto found = client_.findOne(database_, collection, key)) {
      return integerAt(found->raw(), "_id").value_or(0);
    }
    const std::int64_t id = client_.takeNumber(database_, collection);
    Bson document = withId(id);
    bson_concat(&document.raw(), &key.raw());
    bson_concat(&document.raw(), &rest.raw());
    const MongoWrite write = client_.insert(database_, collection, {document});
    if (!write.refused.empty()) {
      client_.fail("add a " + collection.substr(0, collection.size() - 1), write.why);
    }
    if (!write.duplicates.empty()) continue;  // another process was faster
    undo_.onFailure([this, collection, id] {
      client_.remove(database_, collection, withId(id));
      forget(id);
    });
    return id;
  }
}

/// Whichever kind of entry has this number: it can be read again.
void MongoCatalog::forget(std::int64_t id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  recordings_.erase(id);
  channels_.erase(id);
}

std::int64_t MongoCatalog::addRecording(const Recording& recording) {
  const std::string key = recording.key.empty() ? newKey() : recording.key;
  return findOrInsert("recordings", Bson().add("key", key),
                      Bson().add("source", recording.source).add("robot", recording.robot));
}

std::string MongoCatalog::definitionId(const Channel& channel) {
  const std::string all = channel.type + '\0' + channel.definition;
  const auto* data = reinterpret_cast<const std::uint8_t*>(all.data());
  const std::string id = channel.md5 + " " + std::to_string(checksumOf(data, all.size()));
  Bson definition;
  definition.add("_id", id).add("type", channel.type).add("md5", channel.md5);
  const MongoWrite write =
      client_.insert(database_, "definitions", {definition.add("text", channel.definition)});
  if (!write.refused.empty()) client_.fail("store a definition", write.why);
  return id;
}

std::int64_t MongoCatalog::addChannel(std::int64_t recording, const Channel& channel) {
  this->recording(recording);  // throws if it is unknown
  Bson key;
  key.add("recording", recording).add("topic", channel.topic);
  key.add("definition", definitionId(channel)).add("latching", channel.latching);
  key.add("caller_id", channel.caller_id);
  return findOrInsert("channels", key, {});
}

void MongoCatalog::removeRecording(std::int64_t id) {
  client_.remove(database_, "channels", Bson().add("recording", id));
  client_.remove(database_, "recordings", withId(id));
  imports_.erase(id);
  const std::lock_guard<std::mutex> lock(mutex_);
  recordings_.erase(id);
  for (auto channel = channels_.begin(); channel != channels_.end();) {
    const bool is_its = channel->second->recording.id == id;
    channel = is_its ? channels_.erase(channel) : std::next(channel);
  }
}

// ---------------------------------------------------------------------------------------- imports

void MongoCatalog::lease(std::int64_t recording) const {
  Bson until;
  until.addDate("import_until", wallClock_ms() + std::chrono::milliseconds(kLease).count());
  client_.update(database_, "recordings", withId(recording), Bson().add("$set", until));
}

void MongoCatalog::beginImport(std::int64_t recording) {
  lease(recording);
  imports_[recording] = std::chrono::steady_clock::now();
}

void MongoCatalog::renewImport(std::int64_t channel) {
  if (imports_.empty()) return;
  const auto import = imports_.find(this->channel(channel)->recording.id);
  const auto now = std::chrono::steady_clock::now();
  if (import == imports_.end() || now - import->second < kRenewal) return;
  lease(import->first);
  import->second = now;
}

void MongoCatalog::finishImport(std::int64_t recording) {
  const auto found = client_.findOne(database_, "recordings", withId(recording));
  if (!found || !hasAt(found->raw(), "import_until")) {
    client_.fail("finish import " + std::to_string(recording), "it is not under way any more");
  }
  client_.update(database_, "recordings", withId(recording),
                 Bson().add("$unset", Bson().add("import_until", 1)));
  undo_.onFailure([this, recording] { lease(recording); });
  imports_.erase(recording);
}

std::vector<std::int64_t> MongoCatalog::deadImports() const {
  Bson before;
  before.addDate("$lt", wallClock_ms());
  std::vector<std::int64_t> dead;
  client_.find(database_, "recordings", Bson().add("import_until", before), {},
               [&](const bson_t& document) {
                 dead.push_back(integerAt(document, "_id").value_or(0));
                 return true;
               });
  return dead;
}

// ---------------------------------------------------------------------------------------- reading

std::vector<Recording> MongoCatalog::recordings() const {
  std::vector<Recording> found;
  const Bson options = Bson().add("sort", Bson().add("_id", 1));
  client_.find(database_, "recordings", {}, options, [&](const bson_t& document) {
    found.push_back(recordingFrom(document));
    return true;
  });
  return found;
}

Recording MongoCatalog::recording(std::int64_t id) const {
  if (const auto known = remembered(mutex_, recordings_, id)) return *known;
  const auto found = client_.findOne(database_, "recordings", withId(id));
  if (!found) {
    throw StoreError(client_.name() + ": there is no recording " + std::to_string(id));
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  return recordings_[id] = recordingFrom(found->raw());
}

MongoCatalog::ChannelPtr MongoCatalog::readChannel(const bson_t& document) const {
  const std::int64_t id = integerAt(document, "_id").value_or(0);
  if (const auto known = remembered(mutex_, channels_, id)) return *known;
  const std::string definition_id = textAt(document, "definition").value_or("");
  const auto definition =
      client_.findOne(database_, "definitions", Bson().add("_id", definition_id));
  if (!definition) client_.fail("read channel " + std::to_string(id), "its definition is missing");
  auto channel = std::make_shared<MongoChannel>();
  channel->id = id;
  channel->recording = recording(integerAt(document, "recording").value_or(0));
  channel->channel.topic = textAt(document, "topic").value_or("");
  channel->channel.type = textAt(definition->raw(), "type").value_or("");
  channel->channel.md5 = textAt(definition->raw(), "md5").value_or("");
  channel->channel.definition = textAt(definition->raw(), "text").value_or("");
  channel->channel.latching = isTrueAt(document, "latching");
  channel->channel.caller_id = textAt(document, "caller_id").value_or("");
  channel->collection = collectionOf(channel->channel.topic);
  channel->schema = Schema::understood(channel->channel.type, channel->channel.definition);
  const std::lock_guard<std::mutex> lock(mutex_);
  return channels_[id] = channel;
}

MongoCatalog::ChannelPtr MongoCatalog::channel(std::int64_t id) const {
  if (const auto known = remembered(mutex_, channels_, id)) return *known;
  const auto found = client_.findOne(database_, "channels", withId(id));
  if (!found) throw StoreError(client_.name() + ": there is no channel " + std::to_string(id));
  return readChannel(found->raw());
}

std::vector<MongoCatalog::ChannelPtr> MongoCatalog::channelsOf(std::int64_t recording) const {
  std::vector<ChannelPtr> found;
  client_.find(database_, "channels", Bson().add("recording", recording), {},
               [&](const bson_t& document) {
                 found.push_back(readChannel(document));
                 return true;
               });
  return found;
}

std::set<std::string> MongoCatalog::collectionsOf(std::int64_t recording) const {
  std::set<std::string> collections;
  for (const ChannelPtr& channel : channelsOf(recording)) collections.insert(channel->collection);
  return collections;
}

}  // namespace afterglow::replay
