#include "replay/bags/mcap_file.hpp"

#include <limits>

namespace afterglow::replay {
namespace {

bool isMd5(const std::string& text) {
  return text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::string entry(const McapChannel& channel, const char* key) {
  const auto found = channel.metadata.find(key);
  return found == channel.metadata.end() ? "" : found->second;
}

Channel ros1Channel(const McapChannel& from, const McapSchema& schema) {
  Channel channel{from.topic, schema.name, entry(from, "md5sum"), schema.text,
                  entry(from, "latching") == "1", entry(from, "callerid")};
  if (!isMd5(channel.md5)) channel.md5.clear();
  return channel;
}

}  // namespace

void McapFile::addTopic(std::uint16_t id) {
  const McapChannel& channel = reader_.definitions().channel(id);
  const McapSchema* schema = reader_.definitions().schema(channel);
  const std::string type = schema ? schema->name : "no type";
  const bool is_ros1 = channel.encoding == "ros1" && schema && schema->encoding == "ros1msg";
  if (is_ros1) {
    intake_.addRos1(id, ros1Channel(channel, *schema));
  } else if (channel.encoding == "cdr" && schema) {
    intake_.addRos2(id, {channel.topic, type, channel.encoding, schema->encoding, schema->text,
                         entry(channel, "offered_qos_profiles")});
  } else if (!schema) {
    intake_.leaveOut(id, channel.topic, type,
                     "its channel names no schema, so that its type is unknown");
  } else {
    intake_.leaveOut(id, channel.topic, type,
                     "it is in \"" + channel.encoding.substr(0, 40) +
                         "\"; messages in ros1 and cdr are read, with definitions");
  }
}

std::optional<RecordedFile::Item> McapFile::next() {
  while (const auto message = reader_.next()) {
    if (!intake_.knows(message->channel)) addTopic(message->channel);
    if (message->log_time > std::uint64_t{std::numeric_limits<std::int64_t>::max()}) {
      reader_.fail("a message of " + reader_.definitions().channel(message->channel).topic +
                   " has the stamp " + std::to_string(message->log_time) +
                   " ns, which is none of this world");
    }
    auto bytes =
        intake_.take(message->channel, Bytes(message->data, message->data + message->size));
    if (!bytes) continue;
    return Item{message->channel, {static_cast<std::int64_t>(message->log_time)},
                *std::move(bytes)};
  }
  return std::nullopt;
}

}  // namespace afterglow::replay
