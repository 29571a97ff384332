#include "replay/plan/play_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "replay/messages/ranges.hpp"
#include "replay/plan/permission.hpp"
#include "replay/plan/recorded_drivers.hpp"
#include "replay/plan/robot_profile.hpp"
#include "replay/query/regular_expression.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/ros2/ros2_definition.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kMostNames = 12;  // of topics that are left out

/// Empty if the store's summary names a topic without messages.
std::optional<Channel> firstChannel(const Store& store, const Behavior& behavior,
                                    const std::string& topic) {
  const std::optional<Message> first = store.messages(behavior, {{topic}, {}, {}})->next();
  return first ? std::optional<Channel>(store.channel(first->channel)) : std::nullopt;
}

std::optional<RegularExpression> patternOf(const std::string& text) {
  if (text.empty()) return std::nullopt;
  return RegularExpression::ofNames(text);
}

/// The topics that a replay of this one sends on: itself, and what cancels its goals.
std::vector<TopicName> publishedOn(const PlannedTopic& topic) {
  std::vector<TopicName> names{topic.output.topic};
  if (isGoal(topic.channel)) names.push_back(actionOf(topic.output.topic) + "/cancel");
  if (!topic.rule_stop.cancel_topic.empty()) names.push_back(topic.rule_stop.cancel_topic);
  return names;
}

bool isMatched(const std::optional<RegularExpression>& pattern, const std::string& topic) {
  return pattern && pattern->isWhole(topic);
}

/// The topics that are asked for by name. One that is none in ROS has no name to ask by.
class NameFilter {
 public:
  explicit NameFilter(const PlanOptions& options)
      : options_(options),
        take_(patternOf(options.regex)),
        leave_(patternOf(options.exclude_regex)) {}

  bool takes(const PlannedTopic& topic) const {
    const bool is_open = options_.topics.empty() && !take_;
    return is_open || isNamed(options_.topics, topic) || isMatched(take_, topic.channel.topic) ||
           isNamed(options_.also, topic);
  }
  bool leavesOut(const PlannedTopic& topic) const {
    return isNamed(options_.exclude, topic) || isMatched(leave_, topic.channel.topic);
  }

  static bool isNamed(const std::vector<TopicName>& names, const PlannedTopic& topic) {
    return topic.recorded && contains(names, *topic.recorded);
  }

 private:
  const PlanOptions& options_;
  const std::optional<RegularExpression> take_, leave_;
};

/// Why a topic is not published, whoever names it, one clause; empty: it may be.
std::string whyForbidden(const PlannedTopic& topic, const PlanOptions& options) {
  if (!topic.recorded) return "ROS has no topic of that name";
  for (const TopicName& published : publishedOn(topic)) {
    const auto obeyed = options.obeyed.find(published);
    if (obeyed != options.obeyed.end()) {
      return "it is " + obeyed->second + " that this replay obeys";
    }
  }
  const auto foreign = whyForeign(topic.channel.definition);
  return foreign ? "its type and fields do not agree with ROS 1's, as it comes from ROS 2: " +
                       *foreign
                 : "";
}

/// The class of a topic and whether it is played, for one behavior and one request.
class TopicChooser {
 public:
  TopicChooser(const Behavior& behavior, const PlanOptions& options)
      : options_(options),
        names_(options),
        robot_(options.robot),
        recorded_(behavior.topics),
        requested_(requestedTopics(behavior)),
        nodes_(recordedNodes(behavior)) {}

  const RecordedNodes& nodes() const { return nodes_; }

  void choose(PlannedTopic& topic, const std::string& type) const {
    topic.named_by = namedBy(topic);
    classify(topic);
    if (topic.topic_class == TopicClass::Body) heedNodes(topic);
    topic.why_not = topic.channel.type == type ? whyNot(topic)
                                               : "the topic began with type " + topic.channel.type;
  }

 private:
  NamedBy namedBy(const PlannedTopic& topic) const {
    if (NameFilter::isNamed(options_.also, topic) || NameFilter::isNamed(options_.topics, topic)) {
      return NamedBy::Replayer;
    }
    if (NameFilter::isNamed(options_.settled, topic)) return NamedBy::Owner;
    return isRequested(topic) ? NamedBy::Recording : NamedBy::Nobody;
  }

  bool isRequested(const PlannedTopic& topic) const {
    return contains(requested_, topic.judged());
  }

  /// The class by the published name, unless the recorded name is endless motion.
  void classify(PlannedTopic& topic) const {
    TopicRole role = robot_.roleOf(topic.judged(), topic.channel.type);
    const TopicRole published = robot_.roleOf(topic.output.topic, topic.channel.type);
    // A controller of velocities is known by its recorded name alone.
    const bool is_named = role.topic_class == TopicClass::Body && isNamedMotion(topic) &&
                          published.topic_class != TopicClass::Control;
    if (role.topic_class != TopicClass::Endless && !is_named) role = published;
    topic.topic_class = role.topic_class;
    topic.why_class = role.why;
    followStopRule(topic);
    if (topic.topic_class == TopicClass::Other) heedBase(topic);
    if (role.topic_class == TopicClass::Shown) heedAudience(topic);
  }

  /// Light and speech that nobody asked for is not shown.
  void heedAudience(PlannedTopic& topic) const {
    const bool is_layer = options_.layers && options_.layers->count(topic.output.topic) != 0;
    if (isRequested(topic)) {
      topic.why_class += ", and the recording's request names it";
    } else if (is_layer) {
      topic.why_class += ", and a projector shows it";
      topic.named_by = std::max(topic.named_by, NamedBy::Recording);
    } else if (topic.named_by == NamedBy::Nobody && placeOf(topic) == ReplayPlace::Robot) {
      topic.topic_class = TopicClass::Other;
      topic.why_class += ", but nobody asked for it to be shown";
    }
  }

  /// The base itself, behind its multiplexer, is the body's if it is named, and if there was no
  /// multiplexer.
  void heedBase(PlannedTopic& topic) const {
    const std::string& type = topic.channel.type;
    if (!isBaseVelocity(type) || !robot_.isBehindMultiplexer(topic.output.topic, type)) return;
    const bool was_alone = topic.named_by == NamedBy::Recording && isDriverNoted(topic.judged(), nodes_) &&
                           !driverOf(topic.judged(), nodes_, recorded_);
    if (topic.named_by != NamedBy::Replayer && !was_alone) return;
    topic.topic_class = TopicClass::Body;
    topic.why_class = was_alone ? "the base, which no multiplexer stood before then"
                                : "the base, which is named: what stands before it is passed by";
  }

  /// Who sent and heard it when it was recorded never permits more.
  void heedNodes(PlannedTopic& topic) const {
    const TopicRow* row =
        TopicTable::ofAllRobots().rowOf(topic.output.topic, topic.channel.type);
    topic.is_by_name = row && row->is_by_name;
    const bool is_velocity = isBaseVelocity(topic.channel.type);
    const auto driver = is_velocity ? driverOf(topic.judged(), nodes_, recorded_) : std::nullopt;
    const bool is_passed = topic.named_by == NamedBy::Replayer;  // whatever stands before it
    if (driver && !(is_passed && driver->topic_class == TopicClass::Other)) {
      topic.topic_class = driver->topic_class;
      topic.why_class = driver->why;
    } else if (wasUnheard(topic.judged(), nodes_)) {
      topic.why_class += "; nobody heard it when it was recorded";
    }
  }

  /// Its recorded name says what it moves, and nothing does under the published one.
  static bool isNamedMotion(const PlannedTopic& topic) {
    const std::string& type = topic.channel.type;
    return knownStop(topic.output.topic, type) == StopKind::None &&
           knownStop(topic.judged(), type) != StopKind::None;
  }

  /// What was refused for want of a stop, and what nobody knows, is the body's with a rule for it.
  void followStopRule(PlannedTopic& topic) const {
    if (!topic.recorded) return;
    const auto rule = options_.rewriting.stops.find(*topic.recorded);
    if (rule == options_.rewriting.stops.end()) return;
    topic.rule_stop = rule->second;
    topic.modality = Modality::Body;
    const bool is_unknown = topic.topic_class == TopicClass::Other &&
                            knownStop(topic.output.topic, topic.channel.type) == StopKind::None;
    if (topic.topic_class == TopicClass::Endless || is_unknown) {
      topic.topic_class = TopicClass::Body;
      topic.why_class = describe(rule->second);
    } else {
      topic.why_class += "; " + describe(rule->second);
    }
  }

  // ------------------------------------------------------------------ what is asked for, permitted

  std::string whyNot(PlannedTopic& topic) const {
    if (names_.leavesOut(topic) || !names_.takes(topic)) return "the topic is not asked for";
    const std::string contradiction = robot_.refusal(topic.output.topic, topic.channel.type);
    const std::string forbidden =
        contradiction.empty() ? whyForbidden(topic, options_) : contradiction;
    PermissionCase asked{kindOf(topic), topic.named_by, options_.is_motion_allowed, placeOf(topic)};
    // What neither moves nor is shown belongs to no modality, and to a whole recording only.
    if (asked.kind == TopicKind::Other && !topic.isNamed() && !wantsAll()) {
      asked.place = ReplayPlace::Robot;
    }
    if (!forbidden.empty()) asked.kind = TopicKind::Forbidden;
    if (!contradiction.empty()) asked.named_by = std::max(asked.named_by, NamedBy::Owner);
    topic.verdict = verdictOf(asked);
    if (topic.verdict == Verdict::Refuse && !isWanted(topic, Modality::Body)) {
      topic.verdict = Verdict::LeaveOut;
    }
    if (!forbidden.empty()) return forbidden;
    if (topic.topic_class == TopicClass::Endless) return topic.why_class;
    if (!isModalityWanted(topic)) {
      topic.verdict = Verdict::LeaveOut;
      return std::string(name(topic.modality)) + " is not asked for";
    }
    if (topic.verdict != Verdict::LeaveOut) return {};
    if (asked.kind == TopicKind::Body) return "motion is not part of it";
    topic.is_nameable = true;
    const bool wants_owner = topic.named_by == NamedBy::Owner;
    return topic.why_class + (wants_owner ? "; motion is not allowed" : "");
  }

  /// A prefix says nothing of what is renamed to lie beside it.
  ReplayPlace placeOf(const PlannedTopic& topic) const {
    const bool is_there = topic.output.topic.rfind(options_.prefix + "/", 0) == 0;
    return is_there ? options_.place : ReplayPlace::Robot;
  }

  static TopicKind kindOf(const PlannedTopic& topic) {
    const TopicClass topic_class = topic.topic_class;
    const bool moves = topic.modality == Modality::Body;
    if (topic_class == TopicClass::Other) return moves ? TopicKind::NamedMotion : TopicKind::Other;
    if (topic_class == TopicClass::Control) return TopicKind::Control;
    if (topic_class == TopicClass::Endless) return TopicKind::Endless;
    if (topic_class == TopicClass::Shown) return TopicKind::Shown;
    return topic.is_by_name ? TopicKind::NamedMotion : TopicKind::Body;
  }

  bool wants(Modality modality) const {
    return options_.only.empty() || options_.only.count(modality) != 0;
  }

  /// Topics that --also or --topics name are wanted whatever they are.
  bool isWanted(const PlannedTopic& topic, Modality modality) const {
    return topic.named_by == NamedBy::Replayer || wants(modality);
  }

  bool wantsAll() const {
    return allOf(kModalities, [this](Modality modality) { return wants(modality); });
  }

  /// Topics that neither move nor are shown have no modality.
  bool isModalityWanted(const PlannedTopic& topic) const {
    const bool has_modality =
        topic.modality != Modality::Ar || topic.topic_class == TopicClass::Shown;
    return !has_modality || wants(topic.modality) || NameFilter::isNamed(options_.also, topic);
  }

  const PlanOptions& options_;
  const NameFilter names_;
  const RobotTopics robot_;
  const std::vector<std::string> recorded_, requested_;
  const RecordedNodes nodes_;
};

void setRewrites(Rewriter& rewriter, PlannedTopic& topic) {
  if (!topic.isPlayed()) return;
  try {
    topic.rewrites = rewriter.rules(topic.channel);
    if (topic.rule_stop.kind != StopKind::None) {
      checkStop(topic.rule_stop, Schema::of(topic.channel));
    }
  } catch (const MessageError& error) {
    topic.why_not = std::string("its definition is not understood: ") + error.what();
  }
}

PlannedTopic planTopic(const TopicSummary& summary, const Channel& channel,
                       const PlanOptions& options, const TopicChooser& chooser,
                       Rewriter& rewriter) {
  PlannedTopic topic;
  topic.channel = topic.output = channel;
  topic.recorded = TopicName::cleaned(channel.topic);
  if (topic.recorded) topic.output.topic = publishedName(*topic.recorded, options).text();
  topic.count = summary.count;
  topic.modality = modalityOf(topic.judged(), summary.type);
  chooser.choose(topic, summary.type);
  setRewrites(rewriter, topic);
  return topic;
}

/// The cancels of a goal topic that the recorder kept beside it; empty if there are none.
std::optional<PlannedTopic> keptCancels(const Store& store, const Behavior& behavior,
                                        const std::string& name) {
  const auto channel = firstChannel(store, behavior, name);
  if (!channel || !isCancel(*channel)) {
    return std::nullopt;
  }
  PlannedTopic topic;
  topic.channel = topic.output = *channel;
  topic.recorded = TopicName::cleaned(name);
  const auto cursor = store.messages(behavior, {{name}, {}, {}});
  while (cursor->next()) ++topic.count;
  return topic;
}

/// Recorded cancels are played if, and only if, the goals of the body that they cancel are.
void pairCancels(const Store& store, const PlanOptions& options, Rewriter& rewriter,
                 PlayPlan& plan) {
  const NameFilter names(options);
  std::map<std::string, PlannedTopic> goals;  // those that are played, by cancel topic
  for (const PlannedTopic& topic : plan.topics) {
    if (topic.movesBody() && isGoal(topic.channel)) {
      goals[actionOf(topic.channel.topic) + "/cancel"] = topic;
    }
  }
  for (const auto& [name, goal] : goals) {
    const auto is_it = [&name = name](const auto& topic) { return topic.channel.topic == name; };
    const bool is_own = anyOf(plan.topics, is_it);
    auto kept = is_own ? std::nullopt : keptCancels(store, plan.behavior, name);
    if (kept) plan.topics.push_back(*std::move(kept));
  }
  for (PlannedTopic& topic : plan.topics) {
    if (!isCancel(topic.channel)) continue;
    const auto goal = goals.find(topic.channel.topic);
    if (goal == goals.end()) {
      if (topic.movesBody()) topic.why_not = "its goals are not played";
      continue;
    }
    topic.output.topic = actionOf(goal->second.output.topic) + "/cancel";
    topic.verdict = goal->second.verdict;
    topic.modality = Modality::Body;
    topic.topic_class = TopicClass::Body;
    topic.why_class = "it cancels a goal of the body";
    topic.is_nameable = false;
    topic.why_not = names.leavesOut(topic) ? "the topic is not asked for" : "";
    setRewrites(rewriter, topic);
  }
}

/// Options for topics that the behavior lacks are mistakes.
void checkNames(const PlayPlan& plan, const PlanOptions& options) {
  std::vector<TopicName> asked = options.topics;
  asked.insert(asked.end(), options.also.begin(), options.also.end());
  asked.insert(asked.end(), options.exclude.begin(), options.exclude.end());
  for (const auto& [from, to] : options.remap) asked.push_back(from);
  for (const TopicName& name : asked) {
    const bool is_known =
        anyOf(plan.topics, [&](const auto& planned) { return planned.recorded == name; });
    if (!is_known) throw std::invalid_argument("the behavior has no topic " + name.text());
  }
  std::map<std::string, std::string> sources;
  for (const PlannedTopic& topic : plan.topics) {
    if (!topic.isPlayed()) continue;
    const auto [other, is_new] = sources.emplace(topic.output.topic, topic.channel.topic);
    if (!is_new && other->second != topic.channel.topic) {
      throw std::invalid_argument(other->second + " and " + topic.channel.topic +
                                  " would both be published on " + topic.output.topic);
    }
  }
}

Stamp secondsInto(const Behavior& behavior, double seconds) {
  return {behavior.begin.ns + std::llround(seconds * 1e9)};
}

void choosePart(PlayPlan& plan, const PlanOptions& options) {
  const Behavior& behavior = plan.behavior;
  const std::string length = std::to_string(plan.durationNs() / 1'000'000) + " ms";
  plan.begin = secondsInto(behavior, options.start_s);
  if (options.until_s) plan.end = std::min(plan.end, secondsInto(behavior, *options.until_s));
  if (options.duration_s) {
    plan.end = std::min(plan.end, secondsInto(behavior, options.start_s + *options.duration_s));
  }
  const bool is_whole = !options.until_s && !options.duration_s && options.start_s == 0;
  if (plan.begin < behavior.begin || (!is_whole && plan.end <= plan.begin)) {
    throw std::invalid_argument("nothing of the behavior lies in that part: it is " + length +
                                " long");
  }
}

}  // namespace

std::vector<std::string> PlayPlan::playedTopics() const {
  std::vector<std::string> names;
  for (const PlannedTopic& topic : topics) {
    if (topic.isPlayed()) names.push_back(topic.channel.topic);
  }
  return names;
}

std::vector<std::string> PlayPlan::motionTopics() const {
  std::vector<std::string> names;
  for (const PlannedTopic& topic : topics) {
    if (topic.movesBody()) names.push_back(topic.channel.topic);
  }
  return names;
}

std::string PlayPlan::refusal() const {
  std::vector<std::string> refused;
  bool is_endless = false;
  for (const PlannedTopic& topic : topics) {
    if (topic.verdict != Verdict::Refuse) continue;
    is_endless = is_endless || topic.topic_class == TopicClass::Endless;
    refused.push_back(topic.channel.topic + " (" + topic.channel.type +
                      ") is not played: " + topic.why_not);
  }
  if (refused.empty()) return unallowedText();
  return fmt::format("{}; --exclude it to play the rest{}", fmt::join(refused, "; "),
                     is_endless ? ", or say in --rules what stops it" : "");
}

std::string PlayPlan::unallowedText() const {
  std::vector<std::string> motion, others, shown;
  for (const PlannedTopic& topic : topics) {
    if (!topic.isPlayed()) continue;
    const bool is_asked = topic.verdict == Verdict::AskOwner;
    const bool moves = topic.modality == Modality::Body;
    const bool is_by_itself = topic.named_by < NamedBy::Replayer;
    if (topic.topic_class == TopicClass::Shown && is_by_itself) {
      shown.push_back(topic.channel.topic);
    }
    if (is_asked && moves) motion.push_back(topic.channel.topic);
    if (is_asked && !moves) {
      others.push_back(fmt::format("{} ({}: {})", topic.channel.topic, name(topic.topic_class),
                                   topic.why_class));
    }
  }
  if (motion.empty() && others.empty()) return "";
  std::string text = "motion is not allowed here (~allow_motion, --allow-motion), and ";
  if (!motion.empty()) {
    text += fmt::format("this behavior moves the robot by {}", fmt::join(motion, ", "));
  }
  if (!others.empty()) {
    text += fmt::format("{}light and speech alone are played without it, not {}",
                        motion.empty() ? "" : "; ", fmt::join(others, ", "));
  }
  if (!shown.empty()) text += fmt::format("; --only ar,speech shows {}", fmt::join(shown, ", "));
  return text;
}

std::vector<std::string> PlayPlan::warnings() const {
  std::vector<std::string> texts;
  for (const PlannedTopic& topic : topics) {
    if (topic.isPlayed() && topic.verdict == Verdict::Warn) {
      texts.push_back(topic.output.topic + " is published as it was recorded: " + topic.why_class);
    }
  }
  return texts;
}

std::string PlayPlan::leftOutText() const {
  std::vector<std::string> unnamed, others, endless;
  for (const PlannedTopic& topic : topics) {
    if (topic.isPlayed()) continue;
    const auto& [name, type] = std::tie(topic.channel.topic, topic.channel.type);
    if (topic.is_nameable) {
      // Topics that can be drawn or heard are most often the ones that were meant.
      (roleOf(name, type).topic_class == TopicClass::Shown ? unnamed : others).push_back(name);
    }
    if (topic.topic_class == TopicClass::Endless) endless.push_back(name);
  }
  const std::string example = unnamed.empty() ? "TOPIC plays one" : unnamed[0] + " plays that one";
  unnamed.insert(unnamed.end(), others.begin(), others.end());
  std::vector<std::string> texts;
  if (!unnamed.empty()) {
    texts.push_back(fmt::format(
        "not played, as nobody named them: {}; --also {}, --dry-run says why each is left out",
        someOf(unnamed, kMostNames), example));
  }
  if (!endless.empty()) {
    texts.push_back("never played, as nothing stops them that is known (--rules may say what): " +
                    someOf(endless, kMostNames));
  }
  return fmt::format("{}", fmt::join(texts, "; "));
}

TopicName publishedName(const TopicName& recorded, const PlanOptions& options) {
  const auto renamed = options.remap.find(recorded);
  const TopicName asked =
      renamed != options.remap.end()
          ? renamed->second
          : TopicName(options.rewriting.robot.topic(recorded.text())).in(options.prefix);
  return options.resolve ? options.resolve(asked) : asked;
}

PlayPlan makePlan(const Store& store, const Behavior& behavior, const PlanOptions& options) {
  PlayPlan plan;
  plan.behavior = behavior;
  plan.rewriting = options.rewriting;
  plan.end = behavior.end.value_or(behavior.begin);
  Rewriter rewriter([] { return std::string(); }, options.rewriting);  // only its rules are asked
  const TopicChooser chooser(behavior, options);
  for (const TopicSummary& summary : store.topics(behavior)) {
    if (const auto channel = firstChannel(store, behavior, summary.topic)) {
      plan.topics.push_back(planTopic(summary, *channel, options, chooser, rewriter));
    }
    if (!behavior.end) {
      plan.end = std::max(plan.end, Stamp{summary.last.ns + 1});  // the last message counts, too
    }
  }
  leaveOutNested(plan.topics, chooser.nodes());
  pairCancels(store, options, rewriter, plan);
  checkNames(plan, options);
  choosePart(plan, options);
  return plan;
}

MotionStop stopOf(const PlannedTopic& topic) {
  if (topic.rule_stop.kind != StopKind::None) return topic.rule_stop;
  MotionStop stop;
  stop.kind = knownStop(topic.output.topic, topic.output.type);
  if (stop.kind == StopKind::None) stop.kind = knownStop(topic.judged(), topic.channel.type);
  return stop;
}

bool isVelocity(const Channel& channel) { return isTwist(channel.type); }

bool isGoal(const Channel& channel) { return endsWith(channel.type, "ActionGoal"); }

bool isCancel(const Channel& channel) {
  return channel.type == kGoalIdType && endsWith(channel.topic, "/cancel");
}

bool isTrajectoryCommand(const Channel& channel) {
  return channel.type == "trajectory_msgs/JointTrajectory";
}

bool isReplacing(const std::string& type) {
  constexpr const char* kTypes[] = {
      "sensor_msgs/PointCloud2", "sensor_msgs/LaserScan",        "nav_msgs/Path",
      "sensor_msgs/Image",       "nav_msgs/OccupancyGrid",       "nav_msgs/GridCells",
      "geometry_msgs/PoseArray", "geometry_msgs/PolygonStamped", "jsk_recognition_msgs/PolygonArray"};
  return contains(kTypes, type);
}

}  // namespace afterglow::replay
