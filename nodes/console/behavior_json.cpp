#include "nodes/console/behavior_json.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "replay/messages/document.hpp"
#include "replay/messages/foreign_json.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/query/outcome.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::nodes {
namespace {

using Json = nlohmann::ordered_json;

Json listJson(const BehaviorSummaries& behaviors) {
  auto list = Json::array();
  for (const auto& one : behaviors) list.push_back(behaviorJson(*one));
  return list;
}

Json entryJson(const StoryEntry& entry) {
  Json json = {{"t", entry.t},
               {"clock", entry.clock},
               {"kind", entry.kind},
               {"text", entry.text},
               {"bad", entry.is_bad}};
  if (entry.behavior != 0) json["behavior"] = entry.behavior;
  return json;
}

Json spanJson(const GoalSpan& span) {
  Json json = {{"from", span.from},
               {"to", nullptr},
               {"outcome", span.outcome},
               {"look", replay::nameOf(replay::lookOf(span.outcome))}};
  if (span.to) json["to"] = *span.to;
  const std::string words = span.to ? span.outcome : "no result";
  json["text"] = "goal " + std::to_string(span.number) + ": " + words +
                 (span.remark.empty() ? "" : " (" + span.remark + ")");
  json["within"] = span.within;
  return json;
}

Json laneJson(const TopicLane& lane) {
  auto spans = Json::array();
  for (const GoalSpan& span : lane.spans) spans.push_back(spanJson(span));
  Json json = {{"topic", lane.topic},        {"type", lane.type},   {"count", lane.count},
               {"hz", nullptr},              {"first", lane.first}, {"last", lane.last},
               {"role", lane.role},          {"context", lane.is_context},
               {"replayed", lane.why_not.empty()}, {"why_not", lane.why_not},
               {"marks", lane.marks},        {"spans", spans}};
  if (lane.hz) json["hz"] = *lane.hz;
  return json;
}

Json parametersOf(const BehaviorDetail& detail) {
  const auto json = replay::parseForeignJson<Json>(detail.behavior.parameters);
  return json.is_object() ? json : Json::object();
}

Json valueOf(const Json& object, const std::string& key) {
  const auto found = object.find(key);
  return found == object.end() ? Json(nullptr) : *found;
}

Json parameterDifferences(const BehaviorDetail& a, const BehaviorDetail& b) {
  const Json of_a = parametersOf(a), of_b = parametersOf(b);
  std::set<std::string> keys;
  for (const auto& [key, value] : of_a.items()) keys.insert(key);
  for (const auto& [key, value] : of_b.items()) keys.insert(key);
  auto list = Json::array();
  for (const std::string& key : keys) {
    const Json in_a = valueOf(of_a, key), in_b = valueOf(of_b, key);
    list.push_back({{"key", key}, {"a", in_a}, {"b", in_b}, {"differs", in_a != in_b}});
  }
  return list;
}

Json topicDifferences(const BehaviorDetail& a, const BehaviorDetail& b) {
  std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> counts;
  for (const TopicLane& lane : a.lanes) {
    if (!lane.is_context) counts[lane.topic].first += lane.count;
  }
  for (const TopicLane& lane : b.lanes) {
    if (!lane.is_context) counts[lane.topic].second += lane.count;
  }
  auto list = Json::array();
  for (const auto& [topic, count] : counts) {
    list.push_back({{"topic", topic},
                    {"a", count.first},
                    {"b", count.second},
                    {"differs", (count.first == 0) != (count.second == 0)}});
  }
  return list;
}

}  // namespace

std::string stampText(replay::Stamp stamp) { return std::to_string(stamp.ns); }

nlohmann::ordered_json behaviorJson(const BehaviorSummary& one) {
  const replay::Behavior& behavior = one.behavior;
  auto parameters = replay::parseForeignJson<nlohmann::ordered_json>(behavior.parameters);
  if (parameters.is_discarded()) parameters = nullptr;
  auto said = nlohmann::ordered_json::array();
  for (const replay::Utterance& sentence : one.said) said.push_back(sentence.text);
  nlohmann::ordered_json json = {
      {"id", behavior.id},
      {"name", behavior.name},
      {"outcome", behavior.outcome},
      {"look", replay::nameOf(replay::lookOf(behavior.outcome))},
      {"begin", stampText(behavior.begin)},
      {"end", nullptr},
      {"duration", static_cast<double>(one.end.ns - behavior.begin.ns) * 1e-9},
      {"said", said},
      {"tags", behavior.tags},
      {"tree_path", behavior.tree_path},
      {"attempt", behavior.attempt},
      {"parent", nullptr},
      {"robot", behavior.robot},
      {"notes", one.notes},
      {"remarks", behavior.remarks},
      {"messages", one.messages},
      {"parameters", parameters}};
  if (behavior.end) json["end"] = stampText(*behavior.end);
  if (behavior.parent != 0) json["parent"] = behavior.parent;
  return json;
}

Json detailJson(const BehaviorDetail& detail) {
  Json json = behaviorJson(*detail.summary);
  json["story"] = Json::array();
  for (const StoryEntry& entry : detail.story.entries) json["story"].push_back(entryJson(entry));
  json["lanes"] = Json::array();
  for (const TopicLane& lane : detail.lanes) json["lanes"].push_back(laneJson(lane));
  json["said"] = Json::array();
  for (const replay::Utterance& sentence : detail.summary->said) {
    const std::int64_t since_ns = sentence.at.ns - detail.behavior.begin.ns;
    json["said"].push_back(
        {{"t", static_cast<double>(since_ns) * 1e-9}, {"text", sentence.text}});
  }
  json["children"] = listJson(detail.children);
  json["attempts"] = listJson(detail.attempts);
  json["key_moments"] = detail.story.key_moments;
  return json;
}

Json comparisonJson(const BehaviorDetail& a, const BehaviorDetail& b) {
  auto story = Json::array();
  for (const StoryPair& pair : pairStories(a.story.entries, b.story.entries)) {
    Json line = {{"a", nullptr}, {"b", nullptr}, {"differs", !pair.a || !pair.b}};
    if (pair.a) line["a"] = entryJson(a.story.entries[*pair.a]);
    if (pair.b) line["b"] = entryJson(b.story.entries[*pair.b]);
    story.push_back(line);
  }
  const Json of_a = behaviorJson(*a.summary), of_b = behaviorJson(*b.summary);
  return {{"a", of_a},
          {"b", of_b},
          {"duration", {{"a", of_a["duration"]}, {"b", of_b["duration"]}}},
          {"topics", topicDifferences(a, b)},
          {"parameters", parameterDifferences(a, b)},
          {"story", story}};
}

HttpResponse jsonResponse(const nlohmann::ordered_json& json) {
  return {200, "application/json",
          json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)};
}

namespace {

constexpr std::size_t kMostWhole = 1000, kProbes = 400;
constexpr std::size_t kMostWholeLarge = 50, kProbesLarge = 50;  // of clouds and images
constexpr std::size_t kMostFields = 64, kLongestArray = 16;

double secondsInto(const replay::Behavior& behavior, replay::Stamp stamp) {
  return static_cast<double>(stamp.ns - behavior.begin.ns) * 1e-9;
}

replay::Stamp stampAt(const replay::Behavior& behavior, double t) {
  return {behavior.begin.ns + std::llround(t * 1e9)};
}

/// Collects messages into columns.
class Columns {
 public:
  explicit Columns(TopicValues& values) : values_(values) {}

  void add(double t, const replay::Value& message) {
    values_.t.push_back(t);
    take(replay::toJson(message, {kLongestArray}), "");
    for (auto& [path, column] : values_.fields) column.resize(values_.t.size(), kNone);
  }

 private:
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  void put(const std::string& path, double number) {
    const bool is_known = values_.fields.count(path) > 0;
    if (!is_known && values_.fields.size() >= kMostFields) {
      values_.is_whole = false;
      return;
    }
    auto& column = values_.fields[path];
    column.resize(values_.t.size() - 1, kNone);
    column.push_back(number);
  }

  void take(const nlohmann::json& value, const std::string& path) {
    if (value.is_boolean()) return put(path, value.get<bool>() ? 1 : 0);
    if (value.is_number()) return put(path, value.get<double>());
    if (value.is_array()) {
      for (std::size_t i = 0; i < value.size(); ++i) {
        take(value[i], path + "[" + std::to_string(i) + "]");
      }
    }
    if (!value.is_object()) return;
    for (const auto& [name, inner] : value.items()) {
      if (name != "header") take(inner, path.empty() ? name : path + "." + name);
    }
  }

  TopicValues& values_;
};

/// Reads a topic's messages of a time.
class ValuesReader {
 public:
  ValuesReader(const replay::Store& store, const replay::Behavior& behavior,
               const replay::TopicSummary& topic)
      : store_(store), behavior_(behavior), topic_(topic), channels_(store), columns_(values_) {}

  TopicValues read(double from, double to) {
    const double first = std::max(from, secondsInto(behavior_, topic_.first));
    const double last = std::min(to, secondsInto(behavior_, topic_.last));
    const double all = secondsInto(behavior_, topic_.last) - secondsInto(behavior_, topic_.first);
    const double share = all > 0 ? std::max(0.0, last - first) / all : 1;
    const bool is_large = replay::isReplacing(topic_.type);
    const std::size_t most = is_large ? kMostWholeLarge : kMostWhole;
    if (share * static_cast<double>(topic_.count) <= static_cast<double>(most)) {
      const auto cursor = store_.messages(behavior_, range(first, last));
      // Where messages crowd, the share says less than there are.
      for (std::size_t i = 0; i < 2 * most; ++i) {
        if (!take(cursor->next())) break;
      }
    } else {
      values_.is_whole = false;
      const std::size_t probes = is_large ? kProbesLarge : kProbes;
      for (std::size_t i = 0; i <= probes; ++i) {
        const double at = first + (last - first) * static_cast<double>(i) / double(probes);
        if (!values_.t.empty() && values_.t.back() >= at) continue;
        if (!take(store_.messages(behavior_, range(at, last))->next())) break;
      }
    }
    return std::move(values_);
  }

 private:
  replay::MessageRange range(double from, double to) const {
    replay::MessageRange range;
    range.topics = {topic_.topic};
    range.begin = stampAt(behavior_, from);
    range.end = replay::Stamp{stampAt(behavior_, to).ns + 1};
    return range;
  }

  bool take(const std::optional<replay::Message>& message) {
    if (!message) return false;
    try {
      columns_.add(secondsInto(behavior_, message->received),
                   replay::decode(channels_.schema(message->channel), message->bytes));
    } catch (const replay::MessageError&) {
    }
    return true;
  }

  const replay::Store& store_;
  const replay::Behavior& behavior_;
  const replay::TopicSummary topic_;
  replay::KnownChannels channels_;
  TopicValues values_;
  Columns columns_;
};

}  // namespace

TopicValues topicValues(const replay::Store& store, const replay::Behavior& behavior,
                        const std::string& topic, double from, double to) {
  for (const auto& known : {store.topics(behavior), store.contextTopics(behavior)}) {
    for (const replay::TopicSummary& one : known) {
      if (one.topic == topic) return ValuesReader(store, behavior, one).read(from, to);
    }
  }
  return {};
}

}  // namespace afterglow::nodes
