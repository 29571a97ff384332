// What a MongoStore reads, but for the messages themselves (mongo_cursor.cpp).
#include <algorithm>
#include <limits>

#include "replay/store/mongo/mongo_cursor.hpp"

namespace afterglow::replay {
namespace {

bool contains(const std::vector<std::string>& texts, const std::string& text) {
  return std::find(texts.begin(), texts.end(), text) != texts.end();
}

Recording recordingFrom(const bson_t& document) {
  return {integerAt(document, "_id").value_or(0), textAt(document, "key").value_or(""),
          textAt(document, "source").value_or(""), textAt(document, "robot").value_or("")};
}

Bson byTime(int direction) {
  return Bson().add("_meta.received_ns", direction).add("_meta.sequence", direction);
}

std::shared_ptr<const Schema> parseSchema(const Channel& channel) {
  try {
    return std::make_shared<const Schema>(Schema::parse(channel.type, channel.definition));
  } catch (const MessageError&) {
    return nullptr;
  }
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

std::vector<Recording> MongoStore::recordings() const {
  std::vector<Recording> found;
  const Bson options = Bson().add("sort", Bson().add("_id", 1));
  client_.find(rest_, "recordings", {}, options, [&](const bson_t& document) {
    found.push_back(recordingFrom(document));
    return true;
  });
  return found;
}

Recording MongoStore::recording(std::int64_t id) const {
  {
    const std::lock_guard<std::mutex> lock(cache_mutex_);
    if (const auto known = known_recordings_.find(id); known != known_recordings_.end()) {
      return known->second;
    }
  }
  const auto found = client_.findOne(rest_, "recordings", Bson().add("_id", id));
  if (!found) {
    throw StoreError(client_.name() + ": there is no recording " + std::to_string(id));
  }
  const std::lock_guard<std::mutex> lock(cache_mutex_);
  return known_recordings_[id] = recordingFrom(found->raw());
}

MongoStore::ChannelPtr MongoStore::readChannel(const bson_t& document) const {
  const std::int64_t id = integerAt(document, "_id").value_or(0);
  {
    const std::lock_guard<std::mutex> lock(cache_mutex_);
    if (const auto known = known_channels_.find(id); known != known_channels_.end()) {
      return known->second;
    }
  }
  const std::string definition_id = textAt(document, "definition").value_or("");
  const auto definition = client_.findOne(rest_, "definitions", Bson().add("_id", definition_id));
  if (!definition) client_.fail("read channel " + std::to_string(id), "its definition is missing");
  auto channel = std::make_shared<MongoChannel>();
  channel->id = id;
  channel->recording = recording(integerAt(document, "recording").value_or(0));
  channel->channel.topic = textAt(document, "topic").value_or("");
  channel->channel.type = textAt(definition->raw(), "type").value_or("");
  channel->channel.md5 = textAt(definition->raw(), "md5").value_or("");
  channel->channel.definition = textAt(definition->raw(), "text").value_or("");
  bson_iter_t latching;
  channel->channel.latching =
      bson_iter_init_find(&latching, &document, "latching") && bson_iter_as_bool(&latching);
  channel->channel.caller_id = textAt(document, "caller_id").value_or("");
  channel->collection = collectionOf(channel->channel.topic);
  channel->schema = parseSchema(channel->channel);
  const std::lock_guard<std::mutex> lock(cache_mutex_);
  return known_channels_[id] = channel;
}

MongoStore::ChannelPtr MongoStore::channelInfo(std::int64_t id) const {
  {
    const std::lock_guard<std::mutex> lock(cache_mutex_);
    if (const auto known = known_channels_.find(id); known != known_channels_.end()) {
      return known->second;
    }
  }
  const auto found = client_.findOne(rest_, "channels", Bson().add("_id", id));
  if (!found) throw StoreError(client_.name() + ": there is no channel " + std::to_string(id));
  return readChannel(found->raw());
}

std::vector<MongoStore::ChannelPtr> MongoStore::channelsOf(std::int64_t recording) const {
  std::vector<ChannelPtr> found;
  client_.find(rest_, "channels", Bson().add("recording", recording), {},
               [&](const bson_t& document) {
                 found.push_back(readChannel(document));
                 return true;
               });
  return found;
}

Channel MongoStore::channel(std::int64_t id) const { return channelInfo(id)->channel; }

std::optional<Behavior> MongoStore::behavior(std::int64_t id) const {
  const auto found = client_.findOne(rest_, "behaviors", Bson().add("_id", id));
  if (!found) return std::nullopt;
  return behaviorFromMongo(found->raw());
}

std::optional<Behavior> MongoStore::behaviorOfKey(const std::string& key) const {
  const auto found = client_.findOne(rest_, "behaviors", Bson().add("key", key));
  if (!found) return std::nullopt;
  return behaviorFromMongo(found->raw());
}

std::optional<Stamp> MongoStore::lastStamp(std::int64_t recording) const {
  std::set<std::string> collections;
  for (const ChannelPtr& channel : channelsOf(recording)) collections.insert(channel->collection);
  const Bson query = Bson().add("_meta.recording", this->recording(recording).key);
  std::optional<Stamp> last;
  for (const std::string& collection : collections) {
    const auto found = client_.findOne(messages_, collection, query, byTime(-1));
    if (!found) continue;
    const Stamp stamp{integerAt(found->raw(), "_meta.received_ns").value_or(0)};
    last = std::max(last.value_or(stamp), stamp);
  }
  return last;
}

std::vector<TopicSummary> MongoStore::topics(const Behavior& behavior) const {
  return summaries(behavior, true);
}

std::vector<TopicSummary> MongoStore::contextTopics(const Behavior& behavior) const {
  return summaries(behavior, false);
}

std::vector<TopicSummary> MongoStore::summaries(const Behavior& behavior, bool own) const {
  std::map<std::pair<std::string, std::string>, std::vector<std::int64_t>> by_type;
  for (const ChannelPtr& channel : channelsOf(behavior.recording)) {
    if (contains(behavior.topics, channel->channel.topic) != own) continue;
    by_type[{channel->channel.topic, channel->channel.type}].push_back(channel->id);
  }
  std::vector<TopicSummary> found;
  for (const auto& [topic_and_type, channels] : by_type) {
    const std::string collection = collectionOf(topic_and_type.first);
    const Bson query = messageQuery(recording(behavior.recording).key, behavior.begin,
                                    behavior.end.value_or(kEndOfTime), channels);
    const auto first = client_.findOne(messages_, collection, query, byTime(1));
    const auto last = client_.findOne(messages_, collection, query, byTime(-1));
    if (!first || !last) continue;
    const auto stamp = [](const Bson& document) {
      return Stamp{integerAt(document.raw(), "_meta.received_ns").value_or(0)};
    };
    found.push_back({topic_and_type.first, topic_and_type.second,
                     static_cast<std::uint64_t>(client_.count(messages_, collection, query)),
                     stamp(*first), stamp(*last)});
  }
  return found;
}

std::unique_ptr<MessageCursor> MongoStore::messages(const Behavior& behavior,
                                                    const MessageRange& range) const {
  return std::make_unique<MongoCursor>(*this, behavior, range);
}

Message MongoStore::readMessage(const bson_t& document) const {
  std::string file;
  Message message = fromMongo(document, file);
  if (file.empty()) return message;
  auto bytes = blobs_.get(file);
  if (!bytes) client_.fail("read message " + std::to_string(message.sequence), "its file is gone");
  message.bytes = std::move(*bytes);
  return message;
}

std::optional<Bytes> MongoStore::file(const std::string& sha256) const {
  return blobs_.get(sha256);
}

}  // namespace afterglow::replay
