#include "replay/plan/robot_topics.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace afterglow::replay {
namespace {

constexpr const char* kSaid = "the robot's profile says so";

/// The strictest first.
constexpr std::array<TopicClass, 5> kClasses{TopicClass::Endless, TopicClass::Control,
                                             TopicClass::Other, TopicClass::Body,
                                             TopicClass::Shown};

int strictness(TopicClass topic_class) {
  switch (topic_class) {
    case TopicClass::Endless:
      return 3;
    case TopicClass::Control:
      return 2;
    case TopicClass::Other:
      return 1;
    default:
      return 0;
  }
}

/// Of this class; what the profile says of the base and the scan is meant for their topics, too.
std::vector<std::string> namesOf(const RobotProfile& robot, TopicClass topic_class) {
  std::vector<std::string> names;
  for (const auto& [word, listed] : robot.topics) {
    const std::optional<TopicClass> said = topicClassCalled(word);
    if (!said) {
      throw std::invalid_argument("the profile of " + robot.name + ": '" + word +
                                  "' is no class of topics");
    }
    if (said == topic_class) names = listed;
  }
  const RobotProfile::Base& base = robot.base;
  if (topic_class == TopicClass::Control) {
    names.insert(names.end(), base.take_over_topics.begin(), base.take_over_topics.end());
  }
  const bool is_behind = !base.output_topic.empty() && base.output_topic != base.velocity_topic;
  if (topic_class == TopicClass::Other && is_behind) names.push_back(base.output_topic);
  if (topic_class == TopicClass::Other && !robot.scan_topic.empty()) {
    names.push_back(robot.scan_topic);  // old ranges hide people
  }
  if (topic_class == TopicClass::Body && !base.velocity_topic.empty()) {
    names.push_back(base.velocity_topic);
  }
  return names;
}

bool mayBeBody(const TopicRole& known, std::string_view topic, std::string_view type) {
  return known.topic_class != TopicClass::Endless && knownStop(topic, type) != StopKind::None;
}

bool mayBeShown(const TopicRole& known, std::string_view topic, std::string_view type) {
  return known.topic_class == TopicClass::Other && modalityOf(topic, type) != Modality::Body;
}

}  // namespace

RobotTopics::RobotTopics(const RobotProfile& robot)
    : robot_(robot.name), output_topic_(robot.base.output_topic) {
  for (const TopicClass topic_class : kClasses) {
    words_.emplace_back(topic_class, namesOf(robot, topic_class));
  }
}

std::optional<TopicClass> RobotTopics::wordOf(std::string_view topic) const {
  for (const auto& [topic_class, names] : words_) {
    const bool is_named = std::any_of(names.begin(), names.end(), [&](const std::string& pattern) {
      return isCalled(topic, pattern);
    });
    if (is_named) return topic_class;
  }
  return std::nullopt;
}

TopicRole RobotTopics::roleOf(std::string_view topic, std::string_view type) const {
  const TopicRole known = replay::roleOf(topic, type);
  const std::optional<TopicClass> word = wordOf(topic);
  if (!word || *word == known.topic_class) return known;
  if (strictness(*word) > strictness(known.topic_class)) return {*word, kSaid};
  const bool is_allowed =
      (*word == TopicClass::Body && mayBeBody(known, topic, type)) ||
      (*word == TopicClass::Shown && mayBeShown(known, topic, type));
  return is_allowed ? TopicRole{*word, kSaid} : known;
}

bool RobotTopics::isBehindMultiplexer(std::string_view topic, std::string_view type) const {
  const TopicRow* row = TopicTable::ofAllRobots().rowOf(topic, type);
  return topic == output_topic_ || (row && row->is_behind);
}

std::string RobotTopics::refusal(std::string_view topic, std::string_view type) const {
  const std::optional<TopicClass> word = wordOf(topic);
  const bool is_permission = word && strictness(*word) == 0;
  const TopicRole role = is_permission ? roleOf(topic, type) : TopicRole();
  if (!is_permission || role.topic_class == *word) return "";
  return "the profile of " + robot_ + " calls it " + std::string(name(*word)) + ", but " +
         (*word == TopicClass::Body ? "how it is stopped is not known" : "it may move something") +
         " (" + role.why + ")";
}

}  // namespace afterglow::replay
