#include "replay/plan/robot_profile.hpp"

#include "replay/messages/ranges.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kSaid = "the robot's profile says so";

/// Returns true if a is stricter than b; a class that may be published by itself is not stricter
/// than the other such class.
bool isStricter(TopicClass a, TopicClass b) { return a < b && a <= TopicClass::Other; }

bool mayBeBody(const TopicRole& known, std::string_view topic, std::string_view type) {
  return known.topic_class != TopicClass::Endless && knownStop(topic, type) != StopKind::None;
}

bool mayBeShown(const TopicRole& known, std::string_view topic, std::string_view type) {
  return known.topic_class == TopicClass::Other && modalityOf(topic, type) != Modality::Body;
}

}  // namespace

/// Takes a profile; its words on the base and the scan are meant for their topics, too.
RobotTopics::RobotTopics(const RobotProfile& robot)
    : robot_(robot.name), output_topic_(robot.base.output_topic), words_(robot.topics) {
  const auto add = [this](TopicClass topic_class, const std::string& topic) {
    if (!topic.empty()) words_[topic_class].push_back(topic);
  };
  const RobotProfile::Base& base = robot.base;
  for (const std::string& topic : base.take_over_topics) add(TopicClass::Control, topic);
  if (base.output_topic != base.velocity_topic) add(TopicClass::Other, base.output_topic);
  add(TopicClass::Other, robot.scan_topic);  // old ranges hide people
  add(TopicClass::Body, base.velocity_topic);
}

std::optional<TopicClass> RobotTopics::wordOf(std::string_view topic) const {
  for (const auto& [topic_class, names] : words_) {
    const auto fits = [&](const std::string& pattern) { return isCalled(topic, pattern); };
    if (anyOf(names, fits)) return topic_class;
  }
  return std::nullopt;
}

TopicRole RobotTopics::roleOf(std::string_view topic, std::string_view type) const {
  const TopicRole known = replay::roleOf(topic, type);
  const std::optional<TopicClass> word = wordOf(topic);
  if (!word || *word == known.topic_class) return known;
  if (isStricter(*word, known.topic_class)) return {*word, kSaid};
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
  const bool is_permission = word && *word > TopicClass::Other;
  const TopicRole role = is_permission ? roleOf(topic, type) : TopicRole();
  if (!is_permission || role.topic_class == *word) return "";
  return "the profile of " + robot_ + " calls it " + std::string(name(*word)) + ", but " +
         (*word == TopicClass::Body ? "how it is stopped is not known" : "it may move something") +
         " (" + role.why + ")";
}

}  // namespace afterglow::replay
