#include "replay/play/play_plan.hpp"

#include <algorithm>
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

std::string whyNotPlayed(const PlannedTopic& topic, const std::string& type,
                         const std::set<Modality>& only) {
  if (topic.channel.type != type) {
    return "the topic began with type " + topic.channel.type;
  }
  const std::string_view never = whyNeverReplayed(topic.channel.topic, type);
  if (!never.empty()) {
    return std::string(never);
  }
  return only.count(topic.modality) == 0 ? std::string(name(topic.modality)) + " is not asked for"
                                         : std::string();
}

PlannedTopic planTopic(const TopicSummary& summary, const Channel& channel,
                       const std::set<Modality>& only, Rewriter& rewriter) {
  PlannedTopic topic;
  topic.channel = channel;
  topic.count = summary.count;
  topic.modality = modalityOf(summary.topic, summary.type);
  topic.why_not = whyNotPlayed(topic, summary.type, only);
  if (topic.isPlayed()) {
    try {
      topic.rewrites = rewriter.rules(channel);
    } catch (const MessageError& error) {
      topic.why_not = std::string("its definition is not understood: ") + error.what();
    }
  }
  return topic;
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

PlayPlan makePlan(const Store& store, const Behavior& behavior, const std::set<Modality>& only) {
  PlayPlan plan;
  plan.behavior = behavior;
  plan.end = behavior.end.value_or(behavior.begin);
  Rewriter rewriter([] { return std::string(); });  // only its rules are asked for
  for (const TopicSummary& summary : store.topics(behavior)) {
    if (const auto channel = firstChannel(store, behavior, summary.topic)) {
      plan.topics.push_back(planTopic(summary, *channel, only, rewriter));
    }
    if (!behavior.end) {
      plan.end = std::max(plan.end, summary.last);
    }
  }
  return plan;
}

bool isVelocity(const Channel& channel) {
  return channel.type == "geometry_msgs/Twist" || channel.type == "geometry_msgs/TwistStamped";
}

}  // namespace afterglow::replay
