#include "replay/store/mongo/mongo_store.hpp"

#include <chrono>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "replay/store/checksum.hpp"

namespace afterglow::replay {
namespace {

/// How long the server believes that an import lives, which nobody else can ask; clocks of a fleet
/// may differ by much less.
constexpr std::chrono::hours kImportLease{1};
constexpr std::chrono::minutes kImportTold{1};

std::int64_t wallClock_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

Bson leaseFromNow() {
  const std::int64_t lease_ms = std::chrono::milliseconds(kImportLease).count();
  Bson until;
  until.addDate("import_until", wallClock_ms() + lease_ms);
  return Bson().add("$set", until);
}

Bson withId(std::int64_t id) { return Bson().add("_id", id); }
Bson set(const char* field, std::int64_t value) {
  return Bson().add("$set", Bson().add(field, value));
}

bool isJsonObject(const std::string& text) {
  return nlohmann::json::parse(text, nullptr, false).is_object();
}

}  // namespace

MongoStore::MongoStore(const std::string& uri, OpenMode mode)
    : client_(uri, std::chrono::seconds(mode == OpenMode::Record ? 10 : 60)),
      messages_(client_.database()),
      rest_(client_.database() + "_afterglow"),
      blobs_(client_, rest_),
      is_read_only_(mode == OpenMode::ReadOnly) {
  prepare(mode);
}

void MongoStore::prepare(OpenMode mode) {
  const Bson build = client_.command("admin", Bson().add("buildInfo", 1), "reach the server");
  // FerretDB breaks the connection over a number that is not finite.
  takes_non_finite_ =
      !bson_has_field(&build.raw(), "ferretdb") && !bson_has_field(&build.raw(), "ferretdbVersion");
  const Bson format = Bson().add("_id", "format");
  const auto found = client_.findOne(rest_, "store", format);
  if (found) {
    const std::int64_t version = integerAt(found->raw(), "version").value_or(0);
    if (version > kMongoVersion) {
      throw StoreError(client_.name() + ": the store has version " + std::to_string(version) +
                       ", this program knows up to " + std::to_string(kMongoVersion));
    }
    return;
  }
  if (mode == OpenMode::ReadOnly) throw StoreError(client_.name() + ": no such store");
  client_.makeIndex(rest_, "recordings", {"key"}, true);
  client_.makeIndex(rest_, "channels",
                    {"recording", "topic", "definition", "latching", "caller_id"}, true);
  client_.makeIndex(rest_, "behaviors", {"key"}, true);
  client_.makeIndex(rest_, "behaviors", {"begin_ns"});
  client_.makeIndex(rest_, "behaviors", {"name", "begin_ns"});
  client_.makeIndex(rest_, "behaviors", {"recording"});
  blobs_.makeIndexes();
  client_.upsert(rest_, "store", Bson(format).add("version", kMongoVersion));
}

void MongoStore::requireWritable() const {
  if (is_read_only_) client_.fail("write", "the store was opened for reading");
}

// ---------------------------------------------------------------------------------------- writing

void MongoStore::onFailure(std::function<void()> undo) {
  if (is_in_transaction_) on_failure_.push_back(std::move(undo));
}

void MongoStore::transaction(const std::function<void()>& work) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  if (is_in_transaction_) return work();
  is_in_transaction_ = true;
  const auto finish = [this] {
    is_in_transaction_ = false;
    std::vector<std::function<void()>> left;
    left.swap(on_success_);
    on_failure_.clear();
    return left;
  };
  try {
    work();
  } catch (...) {
    for (auto undo = on_failure_.rbegin(); undo != on_failure_.rend(); ++undo) {
      try {
        (*undo)();
      } catch (const StoreError&) {  // the first error is the one to tell
      }
    }
    finish();
    throw;
  }
  for (const auto& rest : finish()) rest();
}

std::int64_t MongoStore::addRecording(const Recording& recording) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  requireWritable();
  const std::string key = recording.key.empty() ? newKey() : recording.key;
  const Bson query = Bson().add("key", key);
  for (;;) {
    if (const auto found = client_.findOne(rest_, "recordings", query)) {
      return integerAt(found->raw(), "_id").value_or(0);
    }
    const std::int64_t id = client_.takeNumbers(rest_, "recordings", 1);
    const MongoWrite write = client_.insert(
        rest_, "recordings",
        {withId(id).add("key", key).add("source", recording.source).add("robot", recording.robot)});
    if (!write.refused.empty()) client_.fail("add a recording", write.why);
    if (!write.duplicates.empty()) continue;  // another process was faster
    onFailure([this, id] {
      client_.remove(rest_, "recordings", withId(id));
      const std::lock_guard<std::mutex> cache(cache_mutex_);
      known_recordings_.erase(id);
    });
    return id;
  }
}

std::int64_t MongoStore::beginImport(const Recording& recording) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  Recording fresh = recording;
  fresh.key.clear();
  const std::int64_t id = addRecording(fresh);
  client_.update(rest_, "recordings", withId(id), leaseFromNow());
  imports_[id] = std::chrono::steady_clock::now();
  return id;
}

void MongoStore::prolongImports(const std::vector<Message>& messages) {
  if (imports_.empty() || messages.empty()) return;
  const auto import = imports_.find(channelInfo(messages.front().channel)->recording.id);
  const auto now = std::chrono::steady_clock::now();
  if (import == imports_.end() || now - import->second < kImportTold) return;
  client_.update(rest_, "recordings", withId(import->first), leaseFromNow());
  import->second = now;
}

void MongoStore::finishImport(std::int64_t recording) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  const auto found = client_.findOne(rest_, "recordings", withId(recording));
  if (!found || !bson_has_field(&found->raw(), "import_until")) {
    client_.fail("finish import " + std::to_string(recording), "it is not under way any more");
  }
  client_.update(rest_, "recordings", withId(recording),
                 Bson().add("$unset", Bson().add("import_until", 1)));
  onFailure([this, recording] {
    client_.update(rest_, "recordings", withId(recording), leaseFromNow());
  });
  imports_.erase(recording);
}

void MongoStore::dropRecording(std::int64_t recording) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  requireWritable();
  if (client_.findOne(rest_, "behaviors", Bson().add("recording", recording))) {
    client_.fail("drop recording " + std::to_string(recording), "it has behaviors");
  }
  Behavior all;
  all.recording = recording;
  all.begin = Stamp{std::numeric_limits<std::int64_t>::min()};
  removeUncovered(all);
  client_.remove(rest_, "channels", Bson().add("recording", recording));
  client_.remove(rest_, "recordings", withId(recording));
  imports_.erase(recording);
  const std::lock_guard<std::mutex> cache(cache_mutex_);
  known_recordings_.erase(recording);
  for (auto channel = known_channels_.begin(); channel != known_channels_.end();) {
    const bool is_its = channel->second->recording.id == recording;
    channel = is_its ? known_channels_.erase(channel) : std::next(channel);
  }
}

std::size_t MongoStore::dropUnfinished() {
  Bson before;
  before.addDate("$lt", wallClock_ms());
  std::vector<std::int64_t> dead;
  client_.find(rest_, "recordings", Bson().add("import_until", before), {},
               [&](const bson_t& document) {
                 dead.push_back(integerAt(document, "_id").value_or(0));
                 return true;
               });
  for (const std::int64_t recording : dead) dropRecording(recording);
  return dead.size();
}

std::string MongoStore::definitionId(const Channel& channel) {
  const std::string all = channel.type + '\0' + channel.definition;
  const auto* data = reinterpret_cast<const std::uint8_t*>(all.data());
  const std::string id = channel.md5 + " " + std::to_string(checksumOf(data, all.size()));
  Bson definition;
  definition.add("_id", id).add("type", channel.type).add("md5", channel.md5);
  const MongoWrite write =
      client_.insert(rest_, "definitions", {definition.add("text", channel.definition)});
  if (!write.refused.empty()) client_.fail("store a definition", write.why);
  return id;
}

std::int64_t MongoStore::addChannel(std::int64_t recording, const Channel& channel) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  requireWritable();
  this->recording(recording);
  Bson query;
  query.add("recording", recording).add("topic", channel.topic);
  query.add("definition", definitionId(channel)).add("latching", channel.latching);
  query.add("caller_id", channel.caller_id);
  for (;;) {
    if (const auto found = client_.findOne(rest_, "channels", query)) {
      return integerAt(found->raw(), "_id").value_or(0);
    }
    const std::int64_t id = client_.takeNumbers(rest_, "channels", 1);
    Bson document = withId(id);
    bson_concat(&document.raw(), &query.raw());
    const MongoWrite write = client_.insert(rest_, "channels", {document});
    if (!write.refused.empty()) client_.fail("add a channel", write.why);
    if (!write.duplicates.empty()) continue;  // another process was faster
    onFailure([this, id] {
      client_.remove(rest_, "channels", withId(id));
      const std::lock_guard<std::mutex> cache(cache_mutex_);
      known_channels_.erase(id);
    });
    return id;
  }
}

std::int64_t MongoStore::reserveBehaviorIds(std::int64_t count) {
  requireWritable();
  return client_.takeNumbers(rest_, "behaviors", count);
}

void MongoStore::checkObjects(const Behavior& behavior) const {
  for (const auto& [what, text] : {std::pair("parameters", &behavior.parameters),
                                   std::pair("calibration", &behavior.calibration),
                                   std::pair("snapshot", &behavior.snapshot)}) {
    if (!isJsonObject(*text)) {
      throw StoreError(client_.name() + ": " + what + " of behavior \"" + behavior.name +
                       "\": no JSON object");
    }
  }
}

std::int64_t MongoStore::addBehavior(const Behavior& behavior) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  requireWritable();
  recording(behavior.recording);
  checkObjects(behavior);
  Behavior stored = behavior;
  if (stored.key.empty()) stored.key = newKey();
  if (stored.id == 0) stored.id = reserveBehaviorIds(1);
  const MongoWrite write = client_.insert(rest_, "behaviors", {toMongo(stored)});
  if (!write.refused.empty()) client_.fail("add a behavior", write.why);
  if (!write.duplicates.empty()) {
    client_.fail("add behavior " + std::to_string(stored.id),
                 "its id or its key " + stored.key + " is there already");
  }
  onFailure([this, id = stored.id] { client_.remove(rest_, "behaviors", withId(id)); });
  return stored.id;
}

void MongoStore::updateBehavior(const Behavior& behavior) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  requireWritable();
  const auto before = this->behavior(behavior.id);
  if (!before) {
    throw StoreError(client_.name() + ": there is no behavior " + std::to_string(behavior.id));
  }
  checkObjects(behavior);
  Behavior after = behavior;
  after.key = before->key;
  after.recording = before->recording;
  client_.upsert(rest_, "behaviors", toMongo(after));
  onFailure([this, old = *before] { client_.upsert(rest_, "behaviors", toMongo(old)); });
}

void MongoStore::removeBehavior(std::int64_t id) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  requireWritable();
  const auto removed = behavior(id);
  if (!removed) throw StoreError(client_.name() + ": there is no behavior " + std::to_string(id));
  std::vector<std::int64_t> children;
  client_.find(rest_, "behaviors", Bson().add("parent", id), {}, [&](const bson_t& child) {
    children.push_back(integerAt(child, "_id").value_or(0));
    return true;
  });
  client_.remove(rest_, "behaviors", withId(id));
  client_.update(rest_, "behaviors", Bson().add("parent", id), set("parent", removed->parent));
  if (!is_in_transaction_) return removeUncovered(*removed);
  onFailure([this, old = *removed, children] {
    client_.upsert(rest_, "behaviors", toMongo(old));
    const Bson which = Bson().add("_id", Bson().add("$in", children));
    client_.update(rest_, "behaviors", which, set("parent", old.id));
  });
  on_success_.push_back([this, old = *removed] { removeUncovered(old); });
}

void MongoStore::removeUncovered(const Behavior& removed) const {
  Bson query = messageQuery(recording(removed.recording).key, removed.begin,
                            removed.end.value_or(kEndOfTime), {});
  std::vector<Bson> covered;
  client_.find(rest_, "behaviors", Bson().add("recording", removed.recording), {},
               [&](const bson_t& document) {
                 const Behavior other = behaviorFromMongo(document);
                 Bson interval;
                 interval.add("$gte", other.begin.ns);
                 if (other.end) interval.add("$lt", other.end->ns);
                 covered.push_back(Bson().add("_meta.received_ns", interval));
                 return true;
               });
  if (!covered.empty()) query.add("$nor", covered);
  std::set<std::string> collections;
  for (const ChannelPtr& channel : channelsOf(removed.recording)) {
    collections.insert(channel->collection);
  }
  for (const std::string& collection : collections) {
    Bson with_file(query);
    with_file.add("_meta.file", Bson().add("$exists", true));
    const Bson options = Bson().add("projection", Bson().add("_meta.file", 1));
    client_.find(messages_, collection, with_file, options, [&](const bson_t& document) {
      if (const auto file = textAt(document, "_meta.file")) blobs_.remove(*file);
      return true;
    });
    client_.remove(messages_, collection, query);
  }
}

void MongoStore::addFile(const std::string& sha256, const Bytes& contents) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  requireWritable();
  if (blobs_.contains(sha256)) return;
  blobs_.put(sha256, contents);
  onFailure([this, sha256] { blobs_.remove(sha256); });
}

}  // namespace afterglow::replay
