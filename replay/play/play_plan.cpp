#include "replay/play/play_plan.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace afterglow::replay {
namespace {

constexpr Modality kModalities[] = {Modality::Body, Modality::Ar, Modality::Speech};

/// Empty if the store's summary names a topic without messages.
std::optional<Channel> firstChannel(const Store& store, const Behavior& behavior,
                                    const std::string& topic) {
  const std::optional<Message> first = store.messages(behavior, {{topic}, {}, {}})->next();
  return first ? std::optional<Channel>(store.channel(first->channel)) : std::nullopt;
}

std::optional<std::regex> patternOf(const std::string& text) {
  try {
    return text.empty() ? std::nullopt : std::optional<std::regex>(text);
  } catch (const std::regex_error& error) {
    throw std::invalid_argument("'" + text + "' is no regular expression: " + error.what());
  }
}

bool holdsName(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Which topics are asked for by name.
class NameFilter {
 public:
  explicit NameFilter(const PlanOptions& options)
      : options_(options),
        take_(patternOf(options.regex)),
        leave_(patternOf(options.exclude_regex)) {}

  bool takes(const std::string& topic) const {
    const bool is_open = options_.topics.empty() && !take_;
    const bool is_named =
        holdsName(options_.topics, topic) || (take_ && std::regex_match(topic, *take_));
    const bool is_left_out =
        holdsName(options_.exclude, topic) || (leave_ && std::regex_match(topic, *leave_));
    return (is_open || is_named) && !is_left_out;
  }

 private:
  const PlanOptions& options_;
  const std::optional<std::regex> take_, leave_;
};

std::string whyNotPlayed(const PlannedTopic& topic, const std::string& type,
                         const PlanOptions& options, const NameFilter& names) {
  if (topic.channel.type != type) {
    return "the topic began with type " + topic.channel.type;
  }
  const std::string_view never = options.has_recorded_time
                                     ? whyNotInRecordedTime(topic.channel.topic, type)
                                     : whyNeverReplayed(topic.channel.topic, type);
  if (!never.empty()) {
    return std::string(never);
  }
  if (!names.takes(topic.channel.topic)) {
    return "the topic is not asked for";
  }
  return !options.only.empty() && options.only.count(topic.modality) == 0
             ? std::string(name(topic.modality)) + " is not asked for"
             : std::string();
}

std::string outputName(const std::string& topic, const PlanOptions& options) {
  const auto renamed = options.remap.find(topic);
  const std::string name =
      renamed != options.remap.end() ? renamed->second : options.prefix + topic;
  if (name.size() < 2 || name[0] != '/') {
    throw std::invalid_argument("'" + name + "' is no absolute topic name (for " + topic + ")");
  }
  return name;
}

PlannedTopic planTopic(const TopicSummary& summary, const Channel& channel,
                       const PlanOptions& options, const NameFilter& names, Rewriter& rewriter) {
  PlannedTopic topic;
  topic.channel = topic.output = channel;
  topic.output.topic = outputName(channel.topic, options);
  topic.count = summary.count;
  topic.modality = modalityOf(summary.topic, summary.type);
  topic.why_not = whyNotPlayed(topic, summary.type, options, names);
  if (topic.isPlayed()) {
    try {
      topic.rewrites = rewriter.rules(channel);
    } catch (const MessageError& error) {
      topic.why_not = std::string("its definition is not understood: ") + error.what();
    }
  }
  return topic;
}

/// What is asked of a topic that is not there is a mistake.
void checkNames(const PlayPlan& plan, const PlanOptions& options) {
  std::vector<std::string> asked = options.topics;
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
  const NameFilter names(options);
  for (const TopicSummary& summary : store.topics(behavior)) {
    if (const auto channel = firstChannel(store, behavior, summary.topic)) {
      plan.topics.push_back(planTopic(summary, *channel, options, names, rewriter));
    }
    if (!behavior.end) {
      plan.end = std::max(plan.end, Stamp{summary.last.ns + 1});  // the last message counts, too
    }
  }
  checkNames(plan, options);
  choosePart(plan, options);
  return plan;
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
