#include "replay/plan/topic_role.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "replay/messages/ranges.hpp"
#include "replay/messages/text.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/query/nearest.hpp"

namespace afterglow::replay {
namespace {

/// `*` stands for any characters, slashes too. A text that is longer than a name can be is none that
/// is known: what is recorded may be of any length.
bool matches(std::string_view text, std::string_view pattern) {
  if (text.size() > TopicName::kLongest) return false;
  std::size_t at = 0, in = 0, retry = 0;
  std::optional<std::size_t> star;
  while (at < text.size()) {
    if (in < pattern.size() && pattern[in] == '*') {
      star = in++;
      retry = at;
    } else if (in < pattern.size() && pattern[in] == text[at]) {
      ++at, ++in;
    } else if (star) {  // it stands for one character more
      at = ++retry;
      in = *star + 1;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', in) == std::string_view::npos;
}

template <typename Value>
using Words = std::vector<std::pair<std::string, Value>>;

/// Strict reading of one file.
class TableReader {
 public:
  TableReader(std::string file, const std::string& text) : file_(std::move(file)) {
    root_ = YAML::Load(text);
    checkKeys(root_, {"roles", "motion", "unknown", "modalities", "nesting"});
  }

  TopicTable read() const {
    TopicTable table;
    for (const char* part : {"roles", "motion", "unknown"}) {
      for (const YAML::Node& entry : entriesOf(part)) {
        table.rows.push_back(row(entry));
        table.rows.back().is_motion = part == std::string("motion");
      }
    }
    for (const YAML::Node& entry : entriesOf("modalities")) {
      checkKeys(entry, {"modality", "topics", "types"});
      Words<Modality> words;
      for (const Modality modality : kModalities) words.emplace_back(name(modality), modality);
      table.modalities.emplace_back(pattern(entry), word(entry, "modality", words));
    }
    for (const YAML::Node& entry : entriesOf("nesting")) {
      checkKeys(entry, {"goal", "sends", "velocity"});
      table.nesting.push_back({text(entry, "goal"), text(entry, "sends"), flag(entry, "velocity")});
    }
    return table;
  }

 private:
  [[noreturn]] void refuse(const YAML::Node& at, const std::string& why) const {
    throw std::runtime_error(fmt::format("{}:{}: {}", file_, at.Mark().line + 1, why));
  }

  void checkKeys(const YAML::Node& map, const std::vector<std::string>& keys) const {
    if (!map.IsMap()) refuse(map, "a map of keys and values is expected");
    for (const auto& entry : map) {
      const auto key = entry.first.as<std::string>();
      if (!contains(keys, key)) {
        refuse(entry.first, "'" + key + "' is no key here" + didYouMean(key, keys));
      }
    }
  }

  std::vector<YAML::Node> entriesOf(const std::string& part) const {
    const YAML::Node list = root_[part];
    if (!list.IsDefined() || !list.IsSequence()) refuse(root_, "'" + part + "' should be a list");
    return {list.begin(), list.end()};
  }

  std::string text(const YAML::Node& map, const std::string& key) const {
    const YAML::Node value = map[key];
    if (!value.IsDefined() || value.Scalar().empty()) {  // a list's is empty
      refuse(map, "'" + key + "' should be a text");
    }
    return value.Scalar();
  }

  bool flag(const YAML::Node& map, const std::string& key) const {
    return map[key].IsDefined() &&
           word(map, key, Words<bool>{{"true", true}, {"false", false}});
  }

  template <typename Value>
  Value word(const YAML::Node& map, const std::string& key, const Words<Value>& known) const {
    const std::string said = text(map, key);
    std::vector<std::string> words;
    for (const auto& [one, value] : known) {
      if (one == said) return value;
      words.push_back(one);
    }
    refuse(map[key], "unknown " + key + " '" + said + "'" + didYouMean(said, words));
  }

  std::vector<std::string> texts(const YAML::Node& map, const std::string& key) const {
    std::vector<std::string> found;
    const YAML::Node list = map[key];
    if (!list.IsDefined()) return found;
    if (!list.IsSequence()) refuse(list, "'" + key + "' should be a list");
    for (const YAML::Node& entry : list) {
      if (entry.Scalar().empty()) {
        refuse(entry, "each of '" + key + "' should be a text");
      }
      found.push_back(entry.Scalar());
    }
    return found;
  }

  TopicPattern pattern(const YAML::Node& map) const {
    TopicPattern pattern{texts(map, "topics"), texts(map, "types"), texts(map, "but")};
    if (pattern.names.empty() && pattern.types.empty()) refuse(map, "the row fits everything");
    return pattern;
  }

  TopicRow row(const YAML::Node& map) const {
    checkKeys(map, {"class", "topics", "types", "but", "why", "stop", "by_name",
                    "behind_multiplexer"});
    TopicRow row;
    static_cast<TopicPattern&>(row) = pattern(map);
    row.role.topic_class = word(map, "class", topicClassWords());
    row.role.why = text(map, "why");
    if (map["stop"].IsDefined()) {
      row.role.stop = word(map, "stop", Words<StopKind>{{"zero", StopKind::Zero},
                                                        {"speed", StopKind::Speed},
                                                        {"empty", StopKind::NoPoints},
                                                        {"cancel", StopKind::Cancel},
                                                        {"ends_itself", StopKind::EndsItself},
                                                        {"is_stop", StopKind::IsStop}});
    }
    const bool is_body = row.role.topic_class == TopicClass::Body;
    if (is_body && row.role.stop == StopKind::None) refuse(map, "what moves the body has a stop");
    row.is_by_name = flag(map, "by_name");
    row.is_behind = flag(map, "behind_multiplexer");
    return row;
  }

  const std::string file_;
  YAML::Node root_;
};

}  // namespace

std::string_view name(Modality modality) {
  constexpr std::string_view kNames[] = {"body", "ar", "speech"};
  return kNames[static_cast<std::size_t>(modality)];
}

std::optional<Modality> modalityCalled(std::string_view word) {
  if (word == "light") return Modality::Ar;
  for (const Modality modality : kModalities) {
    if (name(modality) == word) return modality;
  }
  return std::nullopt;
}

std::string_view name(TopicClass topic_class) {
  constexpr std::string_view kNames[] = {"endless motion", "control input", "other", "body",
                                         "shown"};
  return kNames[static_cast<std::size_t>(topic_class)];
}

const std::vector<std::pair<std::string, TopicClass>>& topicClassWords() {
  static const Words<TopicClass> words{{"body", TopicClass::Body},
                                       {"shown", TopicClass::Shown},
                                       {"control", TopicClass::Control},
                                       {"endless", TopicClass::Endless},
                                       {"other", TopicClass::Other}};
  return words;
}

bool isCalled(std::string_view topic, std::string_view pattern) {
  if (topic.size() > TopicName::kLongest) return false;  // nor its end
  if (beginsWith(pattern, "/")) return matches(topic, pattern);
  for (std::size_t slash = topic.find('/'); slash != std::string_view::npos;
       slash = topic.find('/', slash + 1)) {
    if (matches(topic.substr(slash + 1), pattern)) return true;
    if (beginsWith(pattern, "*")) return false;  // the rest is what * has stood for already
  }
  return false;
}

bool TopicPattern::holds(std::string_view topic, std::string_view type) const {
  const auto is_name = [&](const std::string& pattern) { return isCalled(topic, pattern); };
  const auto is_type = [&](const std::string& pattern) { return matches(type, pattern); };
  return (types.empty() || anyOf(types, is_type)) && (names.empty() || anyOf(names, is_name)) &&
         !anyOf(other_types, is_type);
}

TopicTable TopicTable::read(const std::string& file, const std::string& text) {
  return TableReader(file, text).read();
}

const TopicTable& TopicTable::ofAllRobots() {
  static const TopicTable table =
      read(std::string("assets/") + kEmbeddedTopics->name, kEmbeddedTopics->text);
  return table;
}

const TopicRow* TopicTable::rowOf(std::string_view topic, std::string_view type) const {
  const auto row = std::find_if(rows.begin(), rows.end(),
                                [&](const TopicRow& one) { return one.holds(topic, type); });
  return row != rows.end() ? &*row : nullptr;
}

Modality modalityOf(std::string_view topic, std::string_view type) {
  for (const auto& [pattern, modality] : TopicTable::ofAllRobots().modalities) {
    if (pattern.holds(topic, type)) return modality;
  }
  return roleOf(topic, type).topic_class == TopicClass::Endless ? Modality::Body : Modality::Ar;
}

TopicRole roleOf(std::string_view topic, std::string_view type) {
  const TopicRow* row = TopicTable::ofAllRobots().rowOf(topic, type);
  return row ? row->role : TopicRole{TopicClass::Other, "what acts on it is not known"};
}

StopKind knownStop(std::string_view topic, std::string_view type) {
  for (const TopicRow& row : TopicTable::ofAllRobots().rows) {
    if (row.is_motion && row.holds(topic, type)) return row.role.stop;
  }
  return StopKind::None;
}

namespace {

constexpr double kLongestLatency = 5;  // s

/// Calls the function with each "modality=value".
void eachSetting(const std::vector<std::string>& texts,
                 const std::function<void(Modality, const std::string&)>& take) {
  for (const std::string& text : texts) {
    for (const std::string& part : splitAt(',', text)) {
      const std::size_t sign = part.find('=');
      const auto modality = modalityCalled(part.substr(0, sign));
      if (!modality || sign == std::string::npos) {
        throw std::invalid_argument("'" + part + "': write body=, ar= or speech=");
      }
      take(*modality, part.substr(sign + 1));
    }
  }
}

}  // namespace

std::set<Modality> parseModalities(const std::string& text) {
  std::set<Modality> chosen;
  for (const std::string& word : splitAt(',', text)) {
    const auto modality = modalityCalled(word);
    if (!modality)
      throw std::invalid_argument("'" + word + "' is no modality (body, light or ar, speech)");
    chosen.insert(*modality);
  }
  return chosen.empty() ? std::set<Modality>(std::begin(kModalities), std::end(kModalities))
                        : chosen;
}

ModalityLatency parseLatency(const std::vector<std::string>& texts) {
  ModalityLatency latency;
  eachSetting(texts, [&](Modality modality, const std::string& value) {
    char* end = nullptr;
    const double seconds = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != 0 || !(seconds >= 0 && seconds <= kLongestLatency)) {
      throw std::invalid_argument("'" + value + "' is no latency, 0 to 5 s");
    }
    latency[modality] = seconds;
  });
  return latency;
}

FailurePolicy parseOnFailure(const std::vector<std::string>& texts) {
  FailurePolicy policy;
  eachSetting(texts, [&](Modality modality, const std::string& value) {
    if (value != "stop" && value != "go_on") {
      throw std::invalid_argument("'" + value + "' is not what a failure does (stop, go_on)");
    }
    policy[modality] = value == "stop" ? OnFailure::Stop : OnFailure::GoOn;
  });
  return policy;
}

double latencyOf(const ModalityLatency& latency, Modality modality) {
  const auto given = latency.find(modality);
  return given == latency.end() ? 0 : given->second;
}

OnFailure policyOf(const FailurePolicy& policy, Modality modality) {
  const auto found = policy.find(modality);
  if (found != policy.end()) return found->second;
  return modality == Modality::Body ? OnFailure::Stop : OnFailure::GoOn;
}

}  // namespace afterglow::replay
