#include "nodes/behavior_view/topic_lanes.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "replay/messages/document.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/store/known_channels.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint64_t kReadWhole = 1000;      // messages of a topic
constexpr std::uint64_t kReadWholeLarge = 100;  // of clouds and images
constexpr int kProbes = 100;

bool isLarge(const std::string& type) { return replay::isReplacing(type); }

std::string roleWord(const replay::TopicRole& role, const std::string& topic,
                     const std::string& type) {
  switch (role.topic_class) {
    case replay::TopicClass::Body:
    case replay::TopicClass::Shown:
      return std::string(replay::name(replay::modalityOf(topic, type)));
    case replay::TopicClass::Control:
      return "control";
    case replay::TopicClass::Endless:
      return "endless";
    default: {
      static const std::set<std::string> kStates = {"tf2_msgs/TFMessage", "tf/tfMessage",
                                                    "sensor_msgs/JointState", "nav_msgs/Odometry",
                                                    "actionlib_msgs/GoalStatusArray"};
      return kStates.count(type) != 0 ? "state" : "other";
    }
  }
}

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

/// Reads the goals and results of one action in the order of their arrival.
class ActionReader {
 public:
  ActionReader(const replay::Store& store, const replay::Behavior& behavior, std::string goal_topic)
      : store_(store), behavior_(behavior), goal_topic_(std::move(goal_topic)) {}

  std::vector<GoalSpan> read() {
    replay::MessageRange range;
    range.topics = {goal_topic_, replay::actionOf(goal_topic_) + "/result"};
    const auto cursor = store_.messages(behavior_, range);
    while (const auto message = cursor->next()) {
      try {
        take(message->received, channels_.channel(message->channel).topic == goal_topic_,
             replay::decode(channels_.schema(message->channel), message->bytes));
      } catch (const replay::MessageError&) {
      }
    }
    return std::move(spans_);
  }

 private:
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
  replay::KnownChannels channels_{store_};
  std::map<std::string, std::size_t> open_;  ///< span by goal id
  std::vector<GoalSpan> spans_;
};

/// Returns true if a goal was sent and over while another one ran.
bool isWithin(const GoalSpan& inner, const GoalSpan& outer) {
  if (inner.topic == outer.topic || !inner.to) return false;
  const bool ends_within = !outer.to || *inner.to <= *outer.to;
  return inner.from > outer.from && ends_within;
}

/// Returns the goals in the order of their begin, at most 500 of a topic. Results are those of the
/// recording, whether they are the behavior's own or not. Goals that cannot be read are left out.
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

class LaneReader {
 public:
  LaneReader(const replay::Store& store, const replay::Behavior& behavior)
      : store_(store), behavior_(behavior) {}

  std::vector<TopicLane> read() {
    const auto own = store_.topics(behavior_), context = store_.contextTopics(behavior_);
    for (const auto& topic : own) add(topic, false);
    for (const auto& topic : context) add(topic, true);
    for (GoalSpan& span : goalSpans(store_, behavior_, own)) {
      for (TopicLane& lane : lanes_) {
        if (lane.topic == span.topic && lane.spans.size() < kMostMarks) {
          lane.spans.push_back(span);
          break;
        }
      }
    }
    plan();
    mark();
    return std::move(lanes_);
  }

 private:
  double seconds(replay::Stamp stamp) const {
    return static_cast<double>(stamp.ns - behavior_.begin.ns) * 1e-9;
  }

  void add(const replay::TopicSummary& topic, bool is_context) {
    TopicLane lane;
    lane.topic = topic.topic;
    lane.type = topic.type;
    lane.count = topic.count;
    lane.first = seconds(topic.first);
    lane.last = seconds(topic.last);
    lane.hz = topic.rate_hz();
    lane.role = roleWord(replay::roleOf(topic.topic, topic.type), topic.topic, topic.type);
    lane.is_context = is_context;
    if (is_context) lane.why_not = "it is not the behavior's own";
    lanes_.push_back(std::move(lane));
  }

  void plan() {
    std::map<std::string, std::string> why_not;
    try {
      for (const auto& topic : replay::makePlan(store_, behavior_, {}).topics) {
        why_not[topic.channel.topic] = topic.why_not;
      }
    } catch (const std::invalid_argument& error) {  // one without messages, for example
      for (const TopicLane& lane : lanes_) why_not[lane.topic] = error.what();
    }
    for (TopicLane& lane : lanes_) {
      if (!lane.is_context) lane.why_not = why_not[lane.topic];
    }
  }

  void mark() {
    std::map<std::string, TopicLane*> whole;
    replay::MessageRange range;
    for (TopicLane& lane : lanes_) {
      if (lane.count > (isLarge(lane.type) ? kReadWholeLarge : kReadWhole)) {
        probe(lane);
      } else if (whole.emplace(lane.topic, &lane).second) {
        range.topics.push_back(lane.topic);
      }
    }
    if (range.topics.empty()) return;
    replay::KnownChannels channels(store_);
    const auto cursor = store_.messages(behavior_, range);
    while (const auto message = cursor->next()) {
      TopicLane& lane = *whole.at(channels.channel(message->channel).topic);
      lane.marks.push_back(seconds(message->received));
    }
    for (const auto& [topic, lane] : whole) thin(lane->marks);
  }

  /// Evenly, the first and the last included.
  static void thin(std::vector<double>& marks) {
    if (marks.size() <= kMostMarks) return;
    std::vector<double> some;
    for (std::size_t i = 0; i < kMostMarks; ++i) {
      some.push_back(marks[i * (marks.size() - 1) / (kMostMarks - 1)]);
    }
    marks = std::move(some);
  }

  void probe(TopicLane& lane) const {
    replay::MessageRange range;
    range.topics = {lane.topic};
    for (int i = 0; i < kProbes; ++i) {
      const double from = lane.first + (lane.last - lane.first) * i / kProbes;
      if (!lane.marks.empty() && lane.marks.back() >= from) continue;
      range.begin = replay::Stamp{behavior_.begin.ns + static_cast<std::int64_t>(from * 1e9)};
      const auto message = store_.messages(behavior_, range)->next();
      if (!message) break;
      lane.marks.push_back(seconds(message->received));
    }
  }

  const replay::Store& store_;
  const replay::Behavior& behavior_;
  std::vector<TopicLane> lanes_;
};

}  // namespace

std::string actionName(const std::string& goal_topic) {
  const std::string place = replay::actionOf(goal_topic);
  return !place.empty() && place[0] == '/' ? place.substr(1) : place;
}

std::vector<TopicLane> topicLanes(const replay::Store& store, const replay::Behavior& behavior) {
  return LaneReader(store, behavior).read();
}

}  // namespace afterglow::nodes
