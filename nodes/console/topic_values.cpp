#include "nodes/console/topic_values.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "replay/messages/document.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/store/known_channels.hpp"

namespace afterglow::nodes {
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
