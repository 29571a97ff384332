#include "nodes/behavior_view/behavior_story.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "replay/messages/document.hpp"
#include "replay/messages/foreign_json.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/query/outcome.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/behavior_edit.hpp"
#include "replay/store/store_reading.hpp"

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

namespace {

constexpr std::size_t kMostKeyMoments = 6;
constexpr std::size_t kLongestValue = 60;  // bytes
constexpr double kAfterWords_s = 0.5;      // what is said goes with what is shown then
constexpr std::size_t kMostPaired = 300;
constexpr double kTogether_s = 3;  // goals of an action with less between them are told as one

double secondsInto(const replay::Behavior& behavior, replay::Stamp stamp) {
  return static_cast<double>(stamp.ns - behavior.begin.ns) * 1e-9;
}

bool isFailure(const std::string& outcome) {
  return replay::lookOf(outcome) == replay::OutcomeLook::Bad;
}

/// "part: gear, place: 3".
std::string parameterWords(const std::string& parameters) {
  const auto json = replay::parseForeignJson<nlohmann::ordered_json>(parameters);
  std::string words;
  if (!json.is_object()) return words;
  for (const auto& [key, value] : json.items()) {
    std::string text = value.is_string()
                           ? value.get<std::string>()
                           : value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    if (text.size() > kLongestValue) text = text.substr(0, kLongestValue) + "...";
    words += (words.empty() ? "" : ", ") + key + ": " + text;
  }
  return words;
}

StoryEntry entry(double t, const std::string& kind, const std::string& text,
                 const std::string& subject) {
  StoryEntry made;
  made.t = t;
  made.kind = kind;
  made.text = text;
  made.subject = kind + ": " + subject;
  return made;
}

StoryEntry beginEntry(const replay::Behavior& behavior) {
  std::string text = "began " + behavior.name;
  if (behavior.attempt > 1) text += fmt::format(", attempt {}", behavior.attempt);
  const std::string words = parameterWords(behavior.parameters);
  if (!words.empty()) text += " (" + words + ")";
  return entry(0, "began", text, text);
}

StoryEntry endEntry(const BehaviorSummary& one) {
  const double t = secondsInto(one.behavior, one.end);
  if (!one.behavior.end) return entry(t, "ended", "has no end: it runs, or was cut off", "no end");
  const std::string outcome = one.behavior.outcome.empty() ? "ended" : one.behavior.outcome;
  StoryEntry made = entry(t, "ended", fmt::format("{} after {:.1f} s", outcome, t), outcome);
  made.is_bad = isFailure(one.behavior.outcome);
  return made;
}

/// The words for the goals of an action.
struct Deed {
  std::string done, to_do;
};

/// Returns the words by a word in the action's name, the first that fits: an arm's gripper is no
/// arm.
Deed deedOf(const std::string& action) {
  static const std::vector<std::pair<std::string, Deed>> deeds = {
      {"projector", {"turned the projector", "turn the projector"}},
      {"turret", {"turned the projector", "turn the projector"}},
      {"gripper", {"moved the gripper", "move the gripper"}},
      {"hand", {"moved the hand", "move the hand"}},
      {"head", {"turned the head", "turn the head"}},
      {"arm", {"moved the arm", "move the arm"}},
      {"torso", {"moved the torso", "move the torso"}},
      {"base", {"drove", "drive"}},
      {"navigate", {"drove", "drive"}},
      {"ask", {"answered a question", "answer a question"}}};
  for (const auto& [name, deed] : deeds) {
    for (std::size_t at = action.find(name); at != std::string::npos;
         at = action.find(name, at + 1)) {
      const auto isLetter = [&](std::size_t place) {
        return place < action.size() && std::isalpha(static_cast<unsigned char>(action[place]));
      };
      if (!(at > 0 && isLetter(at - 1)) && !isLetter(at + name.size())) return deed;
    }
  }
  return {"did " + action, "do " + action};
}

/// Goals of an action that followed one another and went well: a projector that tracks something is
/// turned again and again.
using GoalRun = std::vector<GoalSpan>;

std::vector<GoalRun> goalRuns(const std::vector<GoalSpan>& spans) {
  std::vector<GoalRun> runs;
  for (const GoalSpan& span : spans) {
    const auto wentWell = [](const GoalSpan& one) { return one.outcome == "succeeded"; };
    const bool goes_on = !runs.empty() && wentWell(span) && wentWell(runs.back().back()) &&
                         span.from - *runs.back().back().to < kTogether_s;
    if (goes_on) {
      runs.back().push_back(span);
    } else {
      runs.push_back({span});
    }
  }
  return runs;
}

/// Stands where the goals began, a failure where it was known.
StoryEntry goalEntry(const GoalRun& run) {
  const GoalSpan &first = run.front(), &last = run.back();
  const std::string action = actionName(first.topic);
  const Deed deed = deedOf(action);
  const std::string within = first.within.empty() ? "" : ", while it " + deedOf(first.within).done;
  if (!first.to) {
    return entry(first.from, "goal", "began to " + deed.to_do + "; no result was recorded" + within,
                 action + " without result");
  }
  const double took = *last.to - first.from;
  if (first.outcome != "succeeded") {
    const std::string why = first.remark.empty() ? "" : ": " + first.remark;
    StoryEntry made = entry(*first.to, "goal",
                            fmt::format("did not {}: {} after {:.1f} s{}{}", deed.to_do,
                                        first.outcome, took, within, why),
                            action + " " + first.outcome);
    made.is_bad = isFailure(first.outcome);
    return made;
  }
  const std::string times = run.size() > 1 ? fmt::format(" {} times", run.size()) : "";
  return entry(first.from, "goal",
               fmt::format("{}{} in {:.1f} s{}", deed.done, times, took, within),
               action + " succeeded");
}

StoryEntry childEntry(const replay::Behavior& behavior, const BehaviorSummary& child) {
  const double t = secondsInto(behavior, child.behavior.begin);
  const std::string& told = child.behavior.outcome;
  const std::string outcome = told.empty() ? "no outcome" : told;
  const std::string attempt = child.behavior.attempt > 1
                                  ? fmt::format(" (attempt {})", child.behavior.attempt)
                                  : "";
  StoryEntry made = entry(t, "child",
                          fmt::format("{}{}: {} after {:.1f} s", child.behavior.name, attempt,
                                      outcome, secondsInto(child.behavior, child.end)),
                          child.behavior.name + attempt + " " + outcome);
  made.behavior = child.behavior.id;
  made.is_bad = isFailure(child.behavior.outcome);
  return made;
}

/// Begin and end, and between them what people would look at, no two within a twelfth of it all.
std::vector<double> keyMoments(const std::vector<StoryEntry>& entries, double duration) {
  const double last = std::max(0.0, duration - 1e-3);
  std::vector<double> moments = {0.0};
  const auto add = [&](double t) {
    const bool is_new = std::all_of(moments.begin(), moments.end(), [&](double other) {
      return std::abs(other - t) > duration / 12;
    });
    if (t > 0 && t <= last && is_new && moments.size() < kMostKeyMoments) moments.push_back(t);
  };
  add(last);
  for (const StoryEntry& one : entries) {
    if (one.is_bad) add(one.t);
  }
  for (const StoryEntry& one : entries) {
    if (one.kind == "said") add(one.t + kAfterWords_s);
  }
  for (const StoryEntry& one : entries) add(one.t);
  for (int i = 1; i < 4; ++i) add(duration * i / 4);
  std::sort(moments.begin(), moments.end());
  return moments;
}

ToldStory tellStory(const BehaviorSummary& one, const std::vector<TopicLane>& lanes,
                    const BehaviorSummaries& children) {
  ToldStory story;
  auto& entries = story.entries;
  for (const replay::Utterance& sentence : one.said) {
    entries.push_back(entry(secondsInto(one.behavior, sentence.at), "said",
                            "said \"" + sentence.text + "\"", sentence.text));
  }
  for (const TopicLane& lane : lanes) {
    for (const GoalRun& run : goalRuns(lane.spans)) entries.push_back(goalEntry(run));
  }
  for (const auto& child : children) entries.push_back(childEntry(one.behavior, *child));
  std::stable_sort(entries.begin(), entries.end(),
                   [](const StoryEntry& a, const StoryEntry& b) { return a.t < b.t; });
  entries.insert(entries.begin(), beginEntry(one.behavior));
  entries.push_back(endEntry(one));
  for (const std::string& remark : one.behavior.remarks) {
    entries.push_back(entry(entries.back().t, "remark", remark, remark));
  }
  const std::int64_t begin_ns = wallBegin(one.behavior).ns;
  for (StoryEntry& made : entries) {
    made.clock = replay::timeParts({begin_ns + static_cast<std::int64_t>(made.t * 1e9)}).clock;
  }
  story.key_moments = keyMoments(entries, secondsInto(one.behavior, one.end));
  return story;
}

}  // namespace

replay::Stamp wallBegin(const replay::Behavior& behavior) {
  return behavior.wall_begin.ns != 0 ? behavior.wall_begin : behavior.begin;
}

BehaviorSummary summaryOf(const replay::Behavior& behavior) {
  BehaviorSummary summary;
  summary.behavior = behavior;
  summary.notes = replay::notesOf(behavior);
  summary.behavior.snapshot.clear();
  summary.behavior.calibration.clear();
  summary.end = behavior.end.value_or(behavior.begin);
  return summary;
}

void addMessages(const replay::Store& store, BehaviorSummary& summary) {
  summary.messages = 0;
  for (const replay::TopicSummary& topic : store.topics(summary.behavior)) {
    summary.messages += topic.count;
    if (!summary.behavior.end) summary.end = std::max(summary.end, topic.last);
  }
  summary.said = replay::sentencesIn(store, summary.behavior);
}

bool isAttemptOf(const replay::Behavior& other, const replay::Behavior& behavior) {
  return other.name == behavior.name && other.tree_path == behavior.tree_path &&
         other.parent == behavior.parent && other.recording == behavior.recording &&
         other.id != behavior.id && (other.attempt > 1 || behavior.attempt > 1);
}

void addStory(const replay::Store& store, BehaviorDetail& detail) {
  detail.lanes = topicLanes(store, detail.behavior);
  detail.story = tellStory(*detail.summary, detail.lanes, detail.children);
}

BehaviorDetail readDetail(const replay::Store& store, const replay::Behavior& behavior) {
  const auto summarized = [&](const replay::Behavior& one) {
    auto summary = std::make_shared<BehaviorSummary>(summaryOf(one));
    addMessages(store, *summary);
    return summary;
  };
  BehaviorDetail detail;
  detail.summary = summarized(behavior);
  detail.behavior = behavior;
  for (const replay::Behavior& other : store.behaviors({})) {
    if (other.parent == behavior.id) detail.children.push_back(summarized(other));
  }
  addStory(store, detail);
  return detail;
}

std::vector<StoryPair> pairStories(const std::vector<StoryEntry>& a,
                                   const std::vector<StoryEntry>& b) {
  const std::size_t rows = std::min(a.size(), kMostPaired);
  const std::size_t columns = std::min(b.size(), kMostPaired);
  // How many pairs there are at most from [i][j] on.
  std::vector<std::vector<int>> most(rows + 1, std::vector<int>(columns + 1, 0));
  for (std::size_t i = rows; i-- > 0;) {
    for (std::size_t j = columns; j-- > 0;) {
      most[i][j] = a[i].subject == b[j].subject ? most[i + 1][j + 1] + 1
                                                : std::max(most[i + 1][j], most[i][j + 1]);
    }
  }
  std::vector<StoryPair> pairs;
  std::size_t i = 0, j = 0;
  while (i < rows || j < columns) {
    if (i < rows && j < columns && a[i].subject == b[j].subject) {
      pairs.push_back({i++, j++});
    } else if (j >= columns || (i < rows && most[i + 1][j] >= most[i][j + 1])) {
      pairs.push_back({i++, std::nullopt});
    } else {
      pairs.push_back({std::nullopt, j++});
    }
  }
  return pairs;
}

}  // namespace afterglow::nodes
