#include "replay/plan/play_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "replay/plan/nested_goals.hpp"
#include "replay/plan/recorded_drivers.hpp"
#include "replay/plan/robot_topics.hpp"
#include "replay/query/regular_expression.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/ros2/ros2_definition.hpp"

namespace afterglow::replay {
namespace {

constexpr Modality kModalities[] = {Modality::Body, Modality::Ar, Modality::Speech};

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

bool holdsName(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The topics that are asked for by name.
class NameFilter {
 public:
  explicit NameFilter(const PlanOptions& options)
      : options_(options),
        take_(patternOf(options.regex)),
        leave_(patternOf(options.exclude_regex)) {}

  bool takes(const std::string& topic) const {
    const bool is_open = options_.topics.empty() && !take_;
    return is_open || holdsName(options_.topics, topic) ||
           (take_ && take_->isWhole(topic));
  }
  bool leavesOut(const std::string& topic) const {
    return holdsName(options_.exclude, topic) || (leave_ && leave_->isWhole(topic));
  }

 private:
  const PlanOptions& options_;
  const std::optional<RegularExpression> take_, leave_;
};

std::string outputName(const std::string& topic, const PlanOptions& options) {
  const auto renamed = options.remap.find(topic);
  const std::string name =
      renamed != options.remap.end() ? renamed->second
                                     : options.prefix + options.rewriting.robot.topic(topic);
  if (name.size() < 2 || name[0] != '/') {
    throw std::invalid_argument("'" + name + "' is no absolute topic name (for " + topic + ")");
  }
  return name;
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
    classify(topic);
    if (topic.topic_class == TopicClass::Body) heedNodes(topic);
    topic.why_not = topic.channel.type == type ? whyNot(topic)
                                               : "the topic began with type " + topic.channel.type;
  }

 private:
  /// The class by the published name, unless the recorded name is endless motion.
  void classify(PlannedTopic& topic) const {
    const std::string& recorded = topic.channel.topic;
    TopicRole role = roleOf(recorded, topic.channel.type);
    const TopicRole published = roleOf(topic.output.topic, topic.channel.type);
    // A controller of velocities is known by its recorded name alone.
    const bool is_named = role.topic_class == TopicClass::Body && isNamedMotion(topic) &&
                          published.topic_class != TopicClass::Control;
    if (role.topic_class != TopicClass::Endless && !is_named) role = published;
    topic.topic_class = role.topic_class;
    topic.why_class = role.why;
    followStopRule(topic);
    if (role.topic_class != TopicClass::Shown) return;
    const bool is_layer = options_.layers && options_.layers->count(topic.output.topic) != 0;
    if (holdsName(requested_, recorded)) {
      topic.why_class += ", and the recording's request names it";
    } else if (is_layer) {
      topic.why_class += ", and a projector shows it";
    } else if (!options_.takes_all) {
      topic.topic_class = TopicClass::Other;
      topic.why_class += ", but nobody asked for it to be shown";
    }
  }

  TopicRole roleOf(const std::string& topic, const std::string& type) const {
    return robot_.roleOf(topic, type);
  }

  /// Who sent and heard it when it was recorded never permits more.
  void heedNodes(PlannedTopic& topic) const {
    const std::string& recorded = topic.channel.topic;
    topic.is_by_name = isByName(topic.output.topic, topic.channel.type);
    const bool is_velocity = isBaseVelocity(topic.channel.type);
    if (const auto driver = is_velocity ? driverOf(recorded, nodes_, recorded_) : std::nullopt) {
      topic.topic_class = driver->topic_class;
      topic.why_class = driver->why;
    } else if (wasUnheard(recorded, nodes_)) {
      topic.why_class += "; nobody heard it when it was recorded";
    }
  }

  /// Its recorded name says what it moves, and nothing does under the published one.
  static bool isNamedMotion(const PlannedTopic& topic) {
    const std::string& type = topic.channel.type;
    return knownStop(topic.output.topic, type) == StopKind::None &&
           knownStop(topic.channel.topic, type) != StopKind::None;
  }

  /// What was refused for want of a stop, and what nobody knows, is the body's with a rule for it.
  void followStopRule(PlannedTopic& topic) const {
    const auto rule = options_.rewriting.stops.find(topic.channel.topic);
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

  std::string whyNot(PlannedTopic& topic) const {
    const std::string& recorded = topic.channel.topic;
    const bool is_added = holdsName(options_.also, recorded);
    if (names_.leavesOut(recorded) || !(is_added || names_.takes(recorded))) {
      return "the topic is not asked for";
    }
    if (std::string contradiction = robot_.refusal(topic.output.topic, topic.channel.type);
        !contradiction.empty()) {
      topic.is_refused = wants(Modality::Body);
      return contradiction;
    }
    const bool is_named = is_added || holdsName(options_.topics, recorded) ||
                          holdsName(options_.settled, recorded);
    if (const std::string never = whyNever(topic); !never.empty()) {
      topic.is_refused = is_added || holdsName(options_.topics, recorded) ||
                         (is_named && wants(Modality::Body)) || isMissedMotion(topic);
      return never;
    }
    if (!is_added && isUnasked(topic)) {
      return std::string(name(topic.modality)) + " is not asked for";
    }
    topic.is_named = is_named;
    if (is_named) return {};
    if (options_.takes_all) return whyNotOfAll(topic);
    if (topic.is_by_name) {
      topic.is_nameable = true;
      return topic.why_class;
    }
    topic.is_nameable =
        topic.topic_class == TopicClass::Other || topic.topic_class == TopicClass::Control;
    return topic.is_nameable ? topic.why_class : std::string();
  }

  std::string whyNever(const PlannedTopic& topic) const {
    if (topic.output.topic == options_.emergency_stop) {
      return "it is the emergency stop that this replay obeys";
    }
    if (const auto why = whyForeign(topic.channel.definition)) {
      return "its type and fields do not agree with ROS 1's, as it comes from ROS 2: " + *why;
    }
    return topic.topic_class == TopicClass::Endless ? topic.why_class : std::string();
  }

  /// Whether the body would be played without a topic that the recording was made for.
  bool isMissedMotion(const PlannedTopic& topic) const {
    return topic.topic_class == TopicClass::Endless && !options_.takes_all &&
           holdsName(requested_, topic.channel.topic) && wants(Modality::Body);
  }

  std::string whyNotOfAll(PlannedTopic& topic) const {
    const bool moves = topic.modality == Modality::Body;
    const bool is_body = topic.topic_class == TopicClass::Body && !topic.is_by_name;
    const bool is_part = is_body || topic.topic_class == TopicClass::Shown || wantsAll();
    topic.is_nameable =
        topic.topic_class == TopicClass::Control || (moves && !is_body) || !is_part;
    if (topic.is_nameable) return topic.why_class;
    return moves && options_.leaves_motion ? "motion is not part of it" : std::string();
  }

  bool wants(Modality modality) const {
    return options_.only.empty() || options_.only.count(modality) != 0;
  }

  bool wantsAll() const {
    return std::all_of(std::begin(kModalities), std::end(kModalities),
                       [this](Modality modality) { return wants(modality); });
  }

  /// Whether its modality is asked for; topics that neither move nor are shown have none.
  bool isUnasked(const PlannedTopic& topic) const {
    const bool has_modality =
        topic.modality != Modality::Ar || topic.topic_class == TopicClass::Shown;
    return has_modality && !wants(topic.modality);
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
      checkStop(topic.rule_stop, Schema::parse(topic.channel.type, topic.channel.definition));
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
  topic.output.topic = outputName(channel.topic, options);
  topic.count = summary.count;
  topic.modality = modalityOf(summary.topic, summary.type);
  chooser.choose(topic, summary.type);
  setRewrites(rewriter, topic);
  return topic;
}

std::string cancelTopicOf(const std::string& goal_topic) {
  return goal_topic.substr(0, goal_topic.rfind('/')) + "/cancel";
}

bool isCancel(const Channel& channel) {
  return channel.type == "actionlib_msgs/GoalID" &&
         cancelTopicOf(channel.topic) == channel.topic;
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
  const auto cursor = store.messages(behavior, {{name}, {}, {}});
  while (cursor->next()) ++topic.count;
  return topic;
}

/// Recorded cancels are played if, and only if, the goals of the body that they cancel are.
void pairCancels(const Store& store, const PlanOptions& options, Rewriter& rewriter,
                 PlayPlan& plan) {
  const NameFilter names(options);
  std::map<std::string, Channel> goals;  // the outputs of those that are played, by cancel topic
  for (const PlannedTopic& topic : plan.topics) {
    const bool is_played = topic.isPlayed() && topic.modality == Modality::Body;
    if (is_played && isGoal(topic.channel)) {
      goals[cancelTopicOf(topic.channel.topic)] = topic.output;
    }
  }
  for (const auto& [name, output] : goals) {
    const auto is_it = [&name = name](const auto& topic) { return topic.channel.topic == name; };
    const bool is_own = std::any_of(plan.topics.begin(), plan.topics.end(), is_it);
    auto kept = is_own ? std::nullopt : keptCancels(store, plan.behavior, name);
    if (kept) plan.topics.push_back(*std::move(kept));
  }
  for (PlannedTopic& topic : plan.topics) {
    if (!isCancel(topic.channel)) continue;
    const auto goal = goals.find(topic.channel.topic);
    if (goal == goals.end()) {
      const bool is_body = topic.isPlayed() && topic.modality == Modality::Body;
      if (is_body) topic.why_not = "its goals are not played";
      continue;
    }
    topic.output.topic = cancelTopicOf(goal->second.topic);
    topic.modality = Modality::Body;
    topic.topic_class = TopicClass::Body;
    topic.why_class = "it cancels a goal of the body";
    topic.is_nameable = false;
    topic.why_not = names.leavesOut(topic.channel.topic) ? "the topic is not asked for" : "";
    setRewrites(rewriter, topic);
  }
}

/// Options for topics that the behavior lacks are mistakes.
void checkNames(const PlayPlan& plan, const PlanOptions& options) {
  std::vector<std::string> asked = options.topics;
  asked.insert(asked.end(), options.also.begin(), options.also.end());
  asked.insert(asked.end(), options.exclude.begin(), options.exclude.end());
  for (const auto& [from, to] : options.remap) asked.push_back(from);
  for (const std::string& topic : asked) {
    const bool is_known =
        std::any_of(plan.topics.begin(), plan.topics.end(),
                    [&](const PlannedTopic& planned) { return planned.channel.topic == topic; });
    if (!is_known) {
      throw std::invalid_argument("the behavior has no topic " + topic);
    }
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

/// The first names, and the number of the others.
std::string shortList(const std::vector<std::string>& names) {
  constexpr std::size_t kMostNames = 12;
  if (names.size() <= kMostNames) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + kMostNames, ", "),
                     names.size() - kMostNames);
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
    if (topic.isPlayed() && topic.modality == Modality::Body) names.push_back(topic.channel.topic);
  }
  return names;
}

std::string PlayPlan::refusal() const {
  std::vector<std::string> refused;
  bool is_endless = false;
  for (const PlannedTopic& topic : topics) {
    if (!topic.is_refused) continue;
    is_endless = is_endless || topic.topic_class == TopicClass::Endless;
    refused.push_back(topic.channel.topic + " (" + topic.channel.type +
                      ") is not played: " + topic.why_not);
  }
  if (refused.empty()) return "";
  return fmt::format("{}; --exclude it to play the rest{}", fmt::join(refused, "; "),
                     is_endless ? ", or say in --rules what stops it" : "");
}

std::vector<std::string> PlayPlan::warnings() const {
  std::vector<std::string> texts;
  for (const PlannedTopic& topic : topics) {
    if (topic.isPlayed() && topic.topic_class == TopicClass::Control) {
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
    texts.push_back("not played, as nobody named them: " + shortList(unnamed) + "; --also " +
                    example + ", --dry-run says why each is left out");
  }
  if (!endless.empty()) {
    texts.push_back("never played, as nothing stops them that is known (--rules may say what): " +
                    shortList(endless));
  }
  return fmt::format("{}", fmt::join(texts, "; "));
}

std::set<Modality> parseModalities(const std::string& text) {
  std::set<Modality> chosen;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    const auto found = std::find_if(std::begin(kModalities), std::end(kModalities),
                                    [&](Modality modality) { return name(modality) == word; });
    if (found == std::end(kModalities)) {
      throw std::invalid_argument("'" + word + "' is no modality (body, ar, speech)");
    }
    chosen.insert(*found);
  }
  return chosen.empty() ? std::set<Modality>(std::begin(kModalities), std::end(kModalities))
                        : chosen;
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
  if (stop.kind == StopKind::None) stop.kind = knownStop(topic.channel.topic, topic.channel.type);
  return stop;
}

bool isVelocity(const Channel& channel) {
  return channel.type == "geometry_msgs/Twist" || channel.type == "geometry_msgs/TwistStamped";
}

bool isGoal(const Channel& channel) {
  const std::string ending = "ActionGoal";
  return channel.type.size() > ending.size() &&
         channel.type.compare(channel.type.size() - ending.size(), ending.size(), ending) == 0;
}

bool isTrajectoryCommand(const Channel& channel) {
  return channel.type == "trajectory_msgs/JointTrajectory";
}

bool isReplacing(const std::string& type) {
  constexpr const char* kTypes[] = {"sensor_msgs/PointCloud2", "sensor_msgs/LaserScan",
                                    "nav_msgs/Path", "sensor_msgs/Image", "nav_msgs/OccupancyGrid"};
  return std::find(std::begin(kTypes), std::end(kTypes), type) != std::end(kTypes);
}

}  // namespace afterglow::replay
