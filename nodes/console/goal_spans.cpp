#include "nodes/console/goal_spans.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "replay/messages/document.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostGoals = 500;
constexpr std::size_t kLongestRemark = 200;  // bytes

bool isGoalTopic(const replay::TopicSummary& topic) {
  return replay::endsWith(topic.topic, "/goal") && replay::endsWith(topic.type, "ActionGoal");
}

/// actionlib_msgs/GoalStatus.status.
const char* outcomeWord(std::uint8_t status) {
  switch (status) {
    case 2:
      return "canceled";
    case 3:
      return "succeeded";
    case 4:
      return "aborted";
    case 5:
      return "rejected";
    case 8:
      return "recalled";
    default:
      return "lost";
  }
}

std::string textAt(const replay::Value& message, const std::string& path) {
  const replay::Value* value = replay::findValue(message, path);
  const auto* text = value ? std::get_if<std::string>(value) : nullptr;
  return text ? *text : "";
}

std::uint8_t byteAt(const replay::Value& message, const std::string& path) {
  const replay::Value* value = replay::findValue(message, path);
  const auto* byte = value ? std::get_if<std::uint8_t>(value) : nullptr;
  return byte ? *byte : 9;  // LOST
}

/// Of one action: its goals and results in the order of their arrival.
class ActionReader {
 public:
  ActionReader(const replay::Store& store, const replay::Behavior& behavior, std::string goal_topic)
      : store_(store), behavior_(behavior), goal_topic_(std::move(goal_topic)) {}

  std::vector<GoalSpan> read() {
    replay::MessageRange range;
    range.topics = {goal_topic_, replay::actionOf(goal_topic_) + "/result"};
    const auto cursor = store_.messages(behavior_, range);
    while (const auto message = cursor->next()) {
      const Source* source = sourceOf(message->channel);
      if (!source) continue;
      try {
        take(message->received, source->is_goal, replay::decode(source->schema, message->bytes));
      } catch (const replay::MessageError&) {
      }
    }
    return std::move(spans_);
  }

 private:
  struct Source {
    bool is_goal;
    replay::Schema schema;
  };

  /// Null for one whose definition cannot be read.
  const Source* sourceOf(std::int64_t id) {
    auto found = sources_.find(id);
    if (found == sources_.end()) {
      const replay::Channel channel = store_.channel(id);
      try {
        auto schema = replay::Schema::parse(channel.type, channel.definition);
        found = sources_.emplace(id, Source{channel.topic == goal_topic_, std::move(schema)}).first;
      } catch (const replay::MessageError&) {
        return nullptr;
      }
    }
    return &found->second;
  }

  void take(replay::Stamp at, bool is_goal, const replay::Value& message) {
    const double t = static_cast<double>(at.ns - behavior_.begin.ns) * 1e-9;
    if (is_goal) {
      if (spans_.size() >= kMostGoals) return;
      open_[textAt(message, "goal_id.id")] = spans_.size();
      GoalSpan span;
      span.topic = goal_topic_;
      span.from = t;
      span.number = static_cast<int>(spans_.size()) + 1;
      spans_.push_back(span);
      return;
    }
    const auto goal = open_.find(textAt(message, "status.goal_id.id"));
    if (goal == open_.end()) return;
    GoalSpan& span = spans_[goal->second];
    span.to = t;
    span.outcome = outcomeWord(byteAt(message, "status.status"));
    span.remark = textAt(message, "status.text").substr(0, kLongestRemark);
    open_.erase(goal);
  }

  const replay::Store& store_;
  const replay::Behavior& behavior_;
  const std::string goal_topic_;
  std::map<std::int64_t, Source> sources_;
  std::map<std::string, std::size_t> open_;  ///< by goal id: its span
  std::vector<GoalSpan> spans_;
};

/// Whether a goal was sent and over while another one ran.
bool isWithin(const GoalSpan& inner, const GoalSpan& outer) {
  if (inner.topic == outer.topic || !inner.to) return false;
  const bool ends_within = !outer.to || *inner.to <= *outer.to;
  return inner.from > outer.from && ends_within;
}

}  // namespace

std::string actionName(const std::string& goal_topic) {
  const std::string place = replay::actionOf(goal_topic);
  return !place.empty() && place[0] == '/' ? place.substr(1) : place;
}

std::vector<GoalSpan> goalSpans(const replay::Store& store, const replay::Behavior& behavior,
                                const std::vector<replay::TopicSummary>& topics) {
  std::set<std::string> names;
  for (const replay::TopicSummary& topic : topics) {
    if (isGoalTopic(topic)) names.insert(topic.topic);
  }
  std::vector<GoalSpan> spans;
  for (const std::string& name : names) {
    const auto more = ActionReader(store, behavior, name).read();
    spans.insert(spans.end(), more.begin(), more.end());
  }
  std::stable_sort(spans.begin(), spans.end(),
                   [](const GoalSpan& a, const GoalSpan& b) { return a.from < b.from; });
  for (GoalSpan& inner : spans) {
    // The latest that was sent before it is the nearest.
    for (const GoalSpan& outer : spans) {
      if (isWithin(inner, outer)) inner.within = actionName(outer.topic);
    }
  }
  return spans;
}

}  // namespace afterglow::nodes
