#include "nodes/console/topic_lanes.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "replay/plan/play_plan.hpp"

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
      static const std::set<std::string> kStates = {
          "tf2_msgs/TFMessage", "tf/tfMessage", "sensor_msgs/JointState", "nav_msgs/Odometry",
          "actionlib_msgs/GoalStatusArray"};
      return kStates.count(type) != 0 ? "state" : "other";
    }
  }
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
    std::map<std::int64_t, TopicLane*> by_channel;
    const auto cursor = store_.messages(behavior_, range);
    while (const auto message = cursor->next()) {
      auto lane = by_channel.find(message->channel);
      if (lane == by_channel.end()) {
        const std::string topic = store_.channel(message->channel).topic;
        lane = by_channel.emplace(message->channel, whole[topic]).first;
      }
      lane->second->marks.push_back(seconds(message->received));
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

std::vector<TopicLane> topicLanes(const replay::Store& store, const replay::Behavior& behavior) {
  return LaneReader(store, behavior).read();
}

}  // namespace afterglow::nodes
