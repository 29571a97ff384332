#include "replay/store/mongo/mongo_messages.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include "replay/store/checksum.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kChunkBytes = 4 << 20;
constexpr const char* kFiles = "fs.files";
constexpr const char* kChunks = "fs.chunks";

std::int64_t checksum(const Bytes& bytes) { return checksumOf(bytes.data(), bytes.size()); }

Bson ofFile(const std::string& id) { return Bson().add("files_id", id); }

}  // namespace

void MongoBlobs::makeIndexes() const {
  client_.makeIndex(database_, kChunks, {"files_id", "n"}, true);
}

void MongoBlobs::put(const std::string& id, const Bytes& contents) const {
  for (std::size_t n = 0; n * kChunkBytes < contents.size(); ++n) {
    const std::size_t begin = n * kChunkBytes;
    const std::size_t size = std::min(kChunkBytes, contents.size() - begin);
    Bson chunk;
    chunk.add("_id", id + "/" + std::to_string(n)).add("files_id", id);
    bson_append_int32(&chunk.raw(), "n", -1, static_cast<std::int32_t>(n));
    client_.upsert(database_, kChunks, chunk.addBinary("data", contents.data() + begin, size));
  }
  Bson file = withId(id);
  file.add("length", static_cast<std::int64_t>(contents.size()));
  bson_append_int32(&file.raw(), "chunkSize", -1, kChunkBytes);
  file.addDate("uploadDate", wallClock_ms()).add("filename", id);
  file.add("metadata", Bson().add("xxh3", checksum(contents)));
  client_.upsert(database_, kFiles, file);
}

std::optional<Bytes> MongoBlobs::get(const std::string& id) const {
  const auto file = client_.findOne(database_, kFiles, withId(id));
  if (!file) return std::nullopt;
  Bytes contents;
  const Bson options = Bson().add("sort", Bson().add("n", 1));
  client_.find(database_, kChunks, ofFile(id), options, [&](const bson_t& chunk) {
    const auto data = bytesAt(chunk, "data");
    if (data) contents.insert(contents.end(), data->begin(), data->end());
    return true;
  });
  if (integerAt(file->raw(), "length") != static_cast<std::int64_t>(contents.size()) ||
      integerAt(file->raw(), "metadata.xxh3") != checksum(contents)) {
    client_.fail("read the file " + id, "its chunks are damaged: length or checksum differ");
  }
  return contents;
}

bool MongoBlobs::contains(const std::string& id) const {
  return client_.findOne(database_, kFiles, withId(id)).has_value();
}

void MongoBlobs::remove(const std::string& id) const {
  client_.remove(database_, kFiles, withId(id));
  client_.remove(database_, kChunks, ofFile(id));
}

namespace {

constexpr std::size_t kBatchMessages = 1000;
constexpr std::size_t kBatchBytes = 32 << 20;

/// FerretDB breaks the connection over a number that is not finite.
bool takesNonFinite(const MongoClient& client) {
  const Bson build = client.command("admin", Bson().add("buildInfo", 1), "reach the server");
  return !hasAt(build.raw(), "ferretdb") && !hasAt(build.raw(), "ferretdbVersion");
}

Bson byTime(int direction) {
  return Bson().add("_meta.received_ns", direction).add("_meta.sequence", direction);
}

Stamp receivedAt(const bson_t& document) {
  return {integerAt(document, "_meta.received_ns").value_or(0)};
}

}  // namespace

Bson messageQuery(const std::string& recording_key, Stamp begin, Stamp end,
                  const std::vector<std::int64_t>& channels) {
  Bson query;
  query.add("_meta.recording", recording_key);
  query.add("_meta.received_ns", Bson().add("$gte", begin.ns).add("$lt", end.ns));
  if (!channels.empty()) query.add("_meta.channel", Bson().add("$in", channels));
  return query;
}

MongoMessages::MongoMessages(const MongoClient& client, const MongoCatalog& catalog,
                             const MongoBlobs& blobs, UndoLog& undo)
    : client_(client),
      catalog_(catalog),
      blobs_(blobs),
      undo_(undo),
      takes_non_finite_(takesNonFinite(client)) {}

// ---------------------------------------------------------------------------------------- writing

/// FerretDB makes tables of collections, and SQL of their names.
void MongoMessages::requireNameable(const std::string& topic) const {
  if (takes_non_finite_ || topic.find_first_of("\"'`\\$") == std::string::npos) return;
  client_.fail("store topic " + topic, "this server takes no quotes, $ or \\ in names");
}

void MongoMessages::prepareCollection(const std::string& collection) {
  if (prepared_.count(collection) > 0) return;
  client_.makeIndex(client_.database(), collection,
                    {"_meta.recording", "_meta.received_ns", "_meta.sequence"});
  prepared_.insert(collection);
}

void MongoMessages::append(const std::vector<Message>& messages, Duplicates duplicates) {
  std::map<std::string, std::vector<const Message*>> by_collection;
  for (const Message& message : messages) {
    if (message.sequence > std::numeric_limits<std::int64_t>::max()) {
      client_.fail("append", "a sequence of " + std::to_string(message.sequence) + " is too large");
    }
    by_collection[catalog_.channel(message.channel)->collection].push_back(&message);
  }
  std::vector<Added> added;
  try {
    for (const auto& [collection, part] : by_collection) {
      appendTo(collection, part, duplicates, added);
    }
  } catch (...) {
    // Who sends again, skipping what is there, leaves it: readers are not to see it come and go.
    if (duplicates == Duplicates::Refuse || undo_.isRunning()) takeBack(added);
    throw;
  }
  undo_.onFailure([this, added] { takeBack(added); });
}

void MongoMessages::appendTo(const std::string& collection,
                             const std::vector<const Message*>& messages, Duplicates duplicates,
                             std::vector<Added>& added) {
  prepareCollection(collection);
  for (std::size_t begin = 0, end = 0; begin < messages.size(); begin = end) {
    std::vector<Bson> documents;
    std::size_t bytes = 0;
    for (; end < messages.size() && end - begin < kBatchMessages && bytes < kBatchBytes; ++end) {
      const auto channel = catalog_.channel(messages[end]->channel);
      MongoDocument made = toMongo(*messages[end], *channel, MongoFields::All, takes_non_finite_);
      if (!made.file.empty() && !blobs_.contains(made.file)) {
        added.push_back({collection, channel->recording.key, {}, {made.file}});
        blobs_.put(made.file, messages[end]->bytes);
      }
      bytes += made.bson.size();
      documents.push_back(std::move(made.bson));
    }
    const MongoWrite write = client_.insert(client_.database(), collection, documents);
    for (std::size_t i = begin; i < end; ++i) {
      if (write.duplicates.count(i - begin) > 0) continue;
      const auto channel = catalog_.channel(messages[i]->channel);
      const std::string& recording = channel->recording.key;
      if (added.empty() || added.back().collection != collection ||
          added.back().recording != recording) {
        added.push_back({collection, recording, {}, {}});
      }
      if (write.refused.count(i - begin) > 0) {
        insertAnyway(*messages[i], *channel, duplicates, added.back());
      } else {
        added.back().sequences.push_back(static_cast<std::int64_t>(messages[i]->sequence));
      }
    }
    if (!write.duplicates.empty() && duplicates == Duplicates::Refuse) {
      refuse(*messages[begin + *write.duplicates.begin()]);
    }
  }
}

void MongoMessages::refuse(const Message& message) const {
  throw StoreError(client_.name() + ": message " + std::to_string(message.sequence) +
                   " of the recording is there already");
}

/// Inserts a message that the server has refused: with all fields, then without any.
void MongoMessages::insertAnyway(const Message& message, const MongoChannel& channel,
                                 Duplicates duplicates, Added& added) {
  std::string why;
  for (const MongoFields fields : {MongoFields::All, MongoFields::None}) {
    const MongoDocument made = toMongo(message, channel, fields, takes_non_finite_);
    const MongoWrite write = client_.insert(client_.database(), channel.collection, {made.bson});
    if (!write.duplicates.empty()) {
      if (duplicates == Duplicates::Skip) return;
      refuse(message);
    }
    if (write.refused.empty()) {
      added.sequences.push_back(static_cast<std::int64_t>(message.sequence));
      return;
    }
    why = write.why;
  }
  client_.fail("append to " + channel.collection, why);
}

void MongoMessages::takeBack(const std::vector<Added>& added) const noexcept {
  try {
    for (const Added& part : added) {
      if (!part.sequences.empty()) {
        client_.remove(client_.database(), part.collection,
                       Bson()
                           .add("_meta.recording", part.recording)
                           .add("_meta.sequence", Bson().add("$in", part.sequences)));
      }
      for (const std::string& file : part.files) blobs_.remove(file);
    }
  } catch (const StoreError&) {  // the first error is the one to tell
  }
}

void MongoMessages::remove(const Behavior& behavior, const std::vector<Behavior>& kept) const {
  Bson query = messageQuery(catalog_.recording(behavior.recording).key, behavior.begin,
                            behavior.end.value_or(kEndOfTime), {});
  std::vector<Bson> covered;
  for (const Behavior& other : kept) {
    Bson interval;
    interval.add("$gte", other.begin.ns);
    if (other.end) interval.add("$lt", other.end->ns);
    covered.push_back(Bson().add("_meta.received_ns", interval));
  }
  if (!covered.empty()) query.add("$nor", covered);
  for (const std::string& collection : catalog_.collectionsOf(behavior.recording)) {
    Bson with_file(query);
    with_file.add("_meta.file", Bson().add("$exists", true));
    find(collection, with_file, {}, [&](const bson_t& document) {
      if (const auto file = textAt(document, "_meta.file")) blobs_.remove(*file);
      return true;
    });
    client_.remove(client_.database(), collection, query);
  }
}

// ---------------------------------------------------------------------------------------- reading

Message MongoMessages::read(const bson_t& document) const {
  std::string file;
  Message message = fromMongo(document, file);
  if (file.empty()) return message;
  auto bytes = blobs_.get(file);
  if (!bytes) client_.fail("read message " + std::to_string(message.sequence), "its file is gone");
  message.bytes = std::move(*bytes);
  return message;
}

bool MongoMessages::matches(const Message& message, const Condition& condition) const {
  return MessageMatcher(catalog_.channel(message.channel)->schema, condition).matches(message);
}

std::optional<Stamp> MongoMessages::lastStamp(std::int64_t recording) const {
  const Bson query = Bson().add("_meta.recording", catalog_.recording(recording).key);
  std::optional<Stamp> last;
  for (const std::string& collection : catalog_.collectionsOf(recording)) {
    const auto found = client_.findOne(client_.database(), collection, query, byTime(-1));
    if (!found) continue;
    const Stamp stamp = receivedAt(found->raw());
    last = std::max(last.value_or(stamp), stamp);
  }
  return last;
}

std::vector<TopicSummary> MongoMessages::summaries(const Behavior& behavior, bool own) const {
  std::map<std::pair<std::string, std::string>, std::vector<std::int64_t>> by_type;
  for (const auto& channel : catalog_.channelsOf(behavior.recording)) {
    const std::string& topic = channel->channel.topic;
    const std::vector<std::string>& names = behavior.topics;
    const bool is_own = std::find(names.begin(), names.end(), topic) != names.end();
    if (is_own == own) by_type[{topic, channel->channel.type}].push_back(channel->id);
  }
  const std::string& database = client_.database();
  std::vector<TopicSummary> found;
  for (const auto& [topic_and_type, channels] : by_type) {
    const std::string collection = collectionOf(topic_and_type.first);
    const Bson query = messageQuery(catalog_.recording(behavior.recording).key, behavior.begin,
                                    behavior.end.value_or(kEndOfTime), channels);
    const auto first = client_.findOne(database, collection, query, byTime(1));
    const auto last = client_.findOne(database, collection, query, byTime(-1));
    if (!first || !last) continue;
    found.push_back({topic_and_type.first, topic_and_type.second,
                     static_cast<std::uint64_t>(client_.count(database, collection, query)),
                     receivedAt(first->raw()), receivedAt(last->raw())});
  }
  return found;
}

}  // namespace afterglow::replay
