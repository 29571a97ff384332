#include "replay/store/mongo/mongo_query.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

namespace afterglow::replay {
namespace {

using nlohmann::json;
using Op = Condition::Op;

const char* operatorOf(Op op) {
  switch (op) {
    case Op::Equal:
      return "$eq";
    case Op::Less:
      return "$lt";
    case Op::LessEqual:
      return "$lte";
    case Op::Greater:
      return "$gt";
    case Op::GreaterEqual:
      return "$gte";
    default:
      return nullptr;
  }
}

std::vector<std::string> split(const std::string& path) {
  std::vector<std::string> parts(1);
  for (const char c : path) {
    if (c == '.') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

/// The kind of number or text at a path, if the server has it as the documents of filters do.
/// Empty for what differs there: uint64 beyond int64, booleans, uint8[] (Binary), and what long
/// arrays become in the documents of filters ("count", "type").
std::optional<FieldType> comparableField(const Schema& schema, const std::string& path) {
  std::size_t type = 0;
  const Field* field = nullptr;
  for (const std::string& part : split(path)) {
    if (field && part.find_first_not_of("0123456789") == std::string::npos) return std::nullopt;
    const bool is_time = field && field->arity == Field::Arity::Single &&
                         (field->type == FieldType::Time || field->type == FieldType::Duration);
    if (is_time && (part == "secs" || part == "nsecs")) return FieldType::Int32;
    if (field && field->type != FieldType::Message) return std::nullopt;
    if (field) type = field->message;
    const auto& fields = schema.types()[type].fields;
    const auto found = std::find_if(fields.begin(), fields.end(),
                                    [&](const Field& each) { return each.name == part; });
    if (found == fields.end()) return std::nullopt;
    field = &*found;
  }
  switch (field->type) {
    case FieldType::UInt64:
    case FieldType::Bool:
    case FieldType::Time:
    case FieldType::Duration:
    case FieldType::Message:
      return std::nullopt;
    case FieldType::UInt8:
      if (field->arity != Field::Arity::Single) return std::nullopt;
      return field->type;
    default:
      return field->type;
  }
}

bool addOperand(Bson& to, const char* key, const json& operand, FieldType type) {
  if (type == FieldType::String) {
    // A text that is no UTF-8 is Binary on the server; only equality with real ones is the same.
    if (!operand.is_string() || std::string_view(key) != "$eq") return false;
    const auto& text = operand.get_ref<const std::string&>();
    if (text.find("\xEF\xBF\xBD") != std::string::npos) return false;
    to.add(key, text);
    return true;
  }
  if (operand.is_number_unsigned() &&
      operand.get<std::uint64_t>() > std::numeric_limits<std::int64_t>::max()) {
    return false;
  }
  if (operand.is_number_integer()) {
    to.add(key, operand.get<std::int64_t>());
  } else if (operand.is_number_float()) {
    to.add(key, operand.get<double>());
  } else {
    return false;
  }
  return true;
}

std::optional<Bson> narrowingOfValue(const Condition& condition, const Schema& schema) {
  std::string path = condition.path;
  FieldType type = FieldType::Int64;
  if (path == "_meta.stamp_ns") {
    path = "_meta.received_ns";
  } else if (path != "_meta.sequence") {
    const auto field = comparableField(schema, path);
    if (!field) return std::nullopt;
    type = *field;
  }
  Bson comparison;
  const char* op = operatorOf(condition.op);
  if (!op || !addOperand(comparison, op, condition.operand, type)) return std::nullopt;
  return Bson().add(path, comparison);
}

std::optional<Bson> narrowingOf(const Condition& condition, const Schema& schema) {
  if (condition.kind == Condition::Kind::Value) return narrowingOfValue(condition, schema);
  const bool is_any = condition.kind == Condition::Kind::Any;
  if (!is_any && condition.kind != Condition::Kind::All) return std::nullopt;
  std::vector<Bson> parts;
  for (const Condition& part : condition.parts) {
    auto narrow = narrowingOf(part, schema);
    if (narrow) {
      parts.push_back(std::move(*narrow));
    } else if (is_any) {
      return std::nullopt;
    }
  }
  if (parts.empty()) return std::nullopt;
  return Bson().add(is_any ? "$or" : "$and", parts);
}

}  // namespace

std::optional<Bson> narrowing(const Condition& condition, const Schema& schema) {
  const auto narrow = narrowingOf(condition, schema);
  if (!narrow) return std::nullopt;
  return Bson().add("$or", std::vector<Bson>{*narrow, Bson().add("_meta.reduced", true)});
}

// ------------------------------------------------------------------------------------ MongoQuery

std::vector<Behavior> MongoQuery::run() {
  const Bson options = Bson().add("sort", Bson().add("begin_ns", -1).add("_id", -1));
  std::vector<Behavior> found;
  if (filter_.limit == 0u) return found;
  client_.find(database_, "behaviors", candidates(), options, [&](const bson_t& document) {
    Behavior behavior = behaviorFromMongo(document);
    if (isWanted(behavior)) found.push_back(std::move(behavior));
    return !filter_.limit || found.size() < *filter_.limit;
  });
  return found;
}

std::vector<std::string> MongoQuery::explain() {
  const auto found = run();
  std::vector<std::string> lines{"behaviors: the server is asked for " + candidates().json() +
                                 ", newest first"};
  for (const std::string& asked : asked_) {
    lines.push_back("messages: the server is asked for " + asked + ", behavior by behavior");
  }
  lines.push_back("looked at " + std::to_string(behaviors_) + " of " +
                  std::to_string(client_.count(database_, "behaviors", {})) + " behaviors and " +
                  std::to_string(looked_at_) + " messages; " + std::to_string(found.size()) +
                  " match");
  return lines;
}

Bson MongoQuery::candidates() const {
  Bson query;
  if (filter_.name) query.add("name", *filter_.name);
  if (filter_.outcome) query.add("outcome", *filter_.outcome);
  if (filter_.robot) query.add("robot", *filter_.robot);
  if (filter_.tag) query.add("tags", *filter_.tag);
  if (filter_.topic) query.add("topics", *filter_.topic);
  if (filter_.until) query.add("begin_ns", Bson().add("$lt", filter_.until->ns));
  if (filter_.since) {
    Bson later, open;
    later.add("end_ns", Bson().add("$gt", filter_.since->ns));
    query.add("$or", std::vector<Bson>{later, open.addNull("end_ns")});
  }
  return query;
}

bool MongoQuery::isWanted(const Behavior& behavior) {
  ++behaviors_;
  if (filter_.since && !behavior.end) {
    const auto last = messages_.lastStamp(behavior.recording);
    if ((last ? last->ns : behavior.begin.ns) + 1 <= filter_.since->ns) return false;
  }
  if (filter_.topic && !hasMessage(behavior, *filter_.topic, nullptr)) return false;
  return !filter_.where || filter_.where->matches(behavior, [&](const std::string& topic,
                                                                const Condition& condition) {
    return hasMessage(behavior, topic, &condition);
  });
}

/// Null `condition`: any message.
bool MongoQuery::hasMessage(const Behavior& behavior, const std::string& topic,
                            const Condition* condition) {
  for (const auto& channel : messages_.catalog().channelsOf(behavior.recording)) {
    if (channel->channel.topic != topic) continue;
    Bson query = messageQuery(channel->recording.key, behavior.begin,
                              behavior.end.value_or(kEndOfTime), {channel->id});
    if (condition && channel->schema) {
      if (const auto narrow = narrowing(*condition, *channel->schema)) {
        bson_concat(&query.raw(), &narrow->raw());
        asked_.insert(topic + " " + narrow->json());
      }
    }
    bool is_found = false;
    Bson options;
    if (!condition) options.add("limit", 1);
    messages_.find(channel->collection, query, options, [&](const bson_t& document) {
      ++looked_at_;
      is_found = !condition || messages_.matches(messages_.read(document), *condition);
      return !is_found;
    });
    if (is_found) return true;
  }
  return false;
}

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
