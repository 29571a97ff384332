#include "replay/store/mongo/mongo_layout.hpp"

#include <algorithm>
#include <limits>

#include "replay/messages/bson_document.hpp"

namespace afterglow::replay {
namespace {

/// "geometry_msgs/Twist" -> "geometry_msgs.msg._Twist.Twist": the Python class.
std::string storedClass(const std::string& type) {
  const auto slash = type.find('/');
  if (slash == std::string::npos) return type;
  const std::string name = type.substr(slash + 1);
  return type.substr(0, slash) + ".msg._" + name + "." + name;
}

Bson metaOf(const Message& message, const MongoChannel& channel) {
  Bson meta;
  meta.add("topic", channel.channel.topic).add("latch", channel.channel.latching);
  meta.addDate("inserted_at", message.received.ns / 1'000'000);
  meta.add("stored_class", storedClass(channel.channel.type));
  meta.add("stored_type", channel.channel.type);
  meta.add("recording", channel.recording.key).add("robot", channel.recording.robot);
  meta.add("received_ns", message.received.ns);
  meta.add("sequence", static_cast<std::int64_t>(message.sequence));
  if (message.header_stamp) meta.add("header_ns", message.header_stamp->ns);
  return meta.add("channel", channel.id).add("md5", channel.channel.md5);
}

/// The fields as BSON; empty if the bytes do not fit the definition, or BSON does not hold them.
std::optional<Bson> fieldsOf(const Message& message, const Schema* schema, MongoFields fields) {
  if (!schema || fields == MongoFields::None) return std::nullopt;
  BsonOptions options;
  if (fields == MongoFields::Reduced) options.longest_array = 64;
  try {
    std::optional<Bson> bson(std::in_place);
    appendBson(decode(*schema, message.bytes), bson->raw(), options);
    return bson;
  } catch (const MessageError&) {
    return std::nullopt;
  }
}

}  // namespace

std::string collectionOf(const std::string& topic) {
  std::string name = topic;
  std::replace(name.begin(), name.end(), '/', '_');
  return name.size() > 1 ? name.substr(1) : "_";
}

MongoDocument toMongo(const Message& message, const MongoChannel& channel, MongoFields fields,
                      bool takes_non_finite) {
  Bson meta = metaOf(message, channel);
  const std::size_t room = kLargestMongoDocument - 2 * meta.size();
  const bool bytes_fit = message.bytes.size() < room;
  std::optional<Bson> body = fieldsOf(message, channel.schema.get(), fields);
  bool is_reduced = fields != MongoFields::All || !body;
  if (body && body->size() > room) {
    const auto smaller = fieldsOf(message, channel.schema.get(), MongoFields::Reduced);
    body.reset();
    if (smaller && smaller->size() <= room) body.emplace(*smaller);
    is_reduced = true;
  }
  if (body && !takes_non_finite) {
    if (const auto finite = withoutNonFinite(body->raw())) {
      body.emplace(*finite);
      is_reduced = true;
    }
  }
  MongoDocument made;
  if (bytes_fit && message.bytes.size() + (body ? body->size() : 0) <= room) {
    meta.add("bytes", message.bytes);
  } else {
    made.file = channel.recording.key + "/" + std::to_string(message.sequence);
    meta.add("file", made.file);
  }
  if (is_reduced) meta.add("reduced", true);
  made.bson.add("_id", Bson()
                           .add("robot", channel.recording.robot)
                           .add("recording", channel.recording.key)
                           .add("sequence", static_cast<std::int64_t>(message.sequence)));
  if (body) bson_concat(&made.bson.raw(), &body->raw());
  made.bson.add("_meta", meta);
  return made;
}

Message fromMongo(const bson_t& document, std::string& file) {
  const auto need = [&](const char* path) {
    const auto value = integerAt(document, path);
    if (!value) throw StoreError(std::string("a message lacks ") + path);
    return *value;
  };
  Message message;
  message.channel = need("_meta.channel");
  message.received = {need("_meta.received_ns")};
  message.sequence = static_cast<std::uint64_t>(need("_meta.sequence"));
  if (const auto header = integerAt(document, "_meta.header_ns")) {
    message.header_stamp = Stamp{*header};
  }
  if (auto bytes = bytesAt(document, "_meta.bytes")) {
    message.bytes = std::move(*bytes);
  } else if (const auto id = textAt(document, "_meta.file")) {
    file = *id;
  } else {
    throw StoreError("a message lacks _meta.bytes");
  }
  return message;
}

Bson toMongo(const Behavior& behavior) {
  Bson bson;
  bson.add("_id", behavior.id).add("key", behavior.key).add("recording", behavior.recording);
  bson.add("name", behavior.name).add("tree_path", behavior.tree_path);
  bson.add("parent", behavior.parent).add("attempt", behavior.attempt);
  bson.add("outcome", behavior.outcome).add("begin_ns", behavior.begin.ns);
  if (behavior.end) {
    bson.add("end_ns", behavior.end->ns);
  } else {
    bson.addNull("end_ns");
  }
  bson.add("wall_begin_ns", behavior.wall_begin.ns).add("robot", behavior.robot);
  bson.add("parameters", behavior.parameters).add("tags", behavior.tags);
  bson.add("calibration", behavior.calibration).add("topics", behavior.topics);
  return bson.add("snapshot", behavior.snapshot).add("remarks", behavior.remarks);
}

Behavior behaviorFromMongo(const bson_t& document) {
  const auto number = [&](const char* path) { return integerAt(document, path).value_or(0); };
  const auto text = [&](const char* path) { return textAt(document, path).value_or(""); };
  Behavior behavior;
  behavior.id = number("_id");
  behavior.key = text("key");
  behavior.recording = number("recording");
  behavior.name = text("name");
  behavior.tree_path = text("tree_path");
  behavior.parent = number("parent");
  behavior.attempt = static_cast<int>(number("attempt"));
  behavior.outcome = text("outcome");
  behavior.begin = {number("begin_ns")};
  if (const auto end = integerAt(document, "end_ns")) behavior.end = Stamp{*end};
  behavior.wall_begin = {number("wall_begin_ns")};
  behavior.robot = text("robot");
  behavior.parameters = text("parameters");
  behavior.tags = textsAt(document, "tags");
  behavior.calibration = text("calibration");
  behavior.topics = textsAt(document, "topics");
  behavior.snapshot = text("snapshot");
  behavior.remarks = textsAt(document, "remarks");
  return behavior;
}

}  // namespace afterglow::replay
