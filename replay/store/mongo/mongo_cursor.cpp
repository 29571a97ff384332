#include "replay/store/mongo/mongo_cursor.hpp"

#include <algorithm>
#include <map>
#include <tuple>

#include "replay/store/mongo/mongo_query.hpp"

namespace afterglow::replay {
namespace {

/// A page ends with the message that reaches one of these; the bytes are for all lanes together.
constexpr std::int64_t kPageMessages = 1000;
constexpr std::size_t kPageBytes = 32 << 20;

auto order(const Message& message) {
  return std::tuple(message.received.ns, message.sequence, message.channel);
}

}  // namespace

MongoCursor::MongoCursor(const MongoMessages& messages, const Behavior& behavior,
                         const MessageRange& range)
    : messages_(messages),
      recording_key_(messages.catalog().recording(behavior.recording).key),
      where_(range.where) {
  end_ = std::min(behavior.end.value_or(kEndOfTime), range.end.value_or(kEndOfTime));
  const Stamp begin = std::max(behavior.begin, range.begin.value_or(behavior.begin));
  const auto& topics = range.topics.empty() ? behavior.topics : range.topics;
  std::map<std::string, Lane> lanes;
  for (const auto& channel : messages.catalog().channelsOf(behavior.recording)) {
    const auto& name = channel->channel.topic;
    if (!range.with_all_topics && std::find(topics.begin(), topics.end(), name) == topics.end()) {
      continue;
    }
    Lane& lane = lanes[channel->collection];
    lane.schema = lane.channels.empty() ? channel->schema : nullptr;
    lane.collection = channel->collection;
    lane.channels.push_back(channel->id);
    lane.received = begin;
  }
  for (auto& [collection, lane] : lanes) lanes_.push_back(std::move(lane));
}

std::optional<Message> MongoCursor::next() {
  Lane* first = nullptr;
  for (Lane& lane : lanes_) {
    while (lane.page.empty() && !lane.is_done) readPage(lane);
    if (lane.page.empty()) continue;
    if (!first || order(lane.page.front()) < order(first->page.front())) first = &lane;
  }
  if (!first) return std::nullopt;
  std::optional<Message> message(std::move(first->page.front()));
  first->page.pop_front();
  return message;
}

Bson MongoCursor::pageQuery(const Lane& lane) const {
  Bson query = messageQuery(recording_key_, lane.received, end_, lane.channels);
  std::vector<Bson> all;
  if (lane.sequence >= 0) {
    Bson later, behind;
    later.add("_meta.received_ns", Bson().add("$gt", lane.received.ns));
    behind.add("_meta.received_ns", lane.received.ns);
    behind.add("_meta.sequence", Bson().add("$gt", lane.sequence));
    all.push_back(Bson().add("$or", std::vector<Bson>{later, behind}));
  }
  if (where_ && lane.schema) {
    if (const auto narrow = narrowing(where_->root(), *lane.schema)) all.push_back(*narrow);
  }
  if (!all.empty()) query.add("$and", all);
  return query;
}

void MongoCursor::readPage(Lane& lane) {
  Bson options;
  options.add("sort", Bson().add("_meta.received_ns", 1).add("_meta.sequence", 1));
  options.add("limit", kPageMessages);
  const std::size_t most_bytes = std::max<std::size_t>(kPageBytes / lanes_.size(), 256 << 10);
  std::int64_t count = 0;
  std::size_t bytes = 0;
  const auto take = [&](const bson_t& document) {
    Message message = messages_.read(document);
    lane.received = message.received;
    lane.sequence = static_cast<std::int64_t>(message.sequence);
    ++count;
    bytes += message.bytes.size();
    const bool is_wanted = !where_ || messages_.matches(message, where_->root());
    if (is_wanted) lane.page.push_back(std::move(message));
    return bytes < most_bytes;
  };
  messages_.find(lane.collection, pageQuery(lane), options, take);
  lane.is_done = count < kPageMessages && bytes < most_bytes;
}

}  // namespace afterglow::replay
