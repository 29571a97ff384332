#include "replay/plan/robot_topics.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace afterglow::replay {
namespace {

constexpr std::string_view kSaid = "the robot's profile says so";

struct ClassWord {
  TopicClass topic_class;
  const char* word;  ///< in a profile
  int strictness;
};

constexpr std::array<ClassWord, 5> kWords{{{TopicClass::Endless, "endless", 3},
                                           {TopicClass::Control, "control", 2},
                                           {TopicClass::Other, "other", 1},
                                           {TopicClass::Body, "body", 0},
                                           {TopicClass::Shown, "shown", 0}}};

int strictness(TopicClass topic_class) {
  return std::find_if(kWords.begin(), kWords.end(),
                      [&](const ClassWord& word) { return word.topic_class == topic_class; })
      ->strictness;
}

void checkWords(const RobotProfile& robot) {
  for (const auto& [word, names] : robot.topics) {
    const auto is_said = [&said = word](const ClassWord& known) { return said == known.word; };
    const bool is_known = std::any_of(kWords.begin(), kWords.end(), is_said);
    if (!is_known) {
      throw std::invalid_argument("the profile of " + robot.name + ": '" + word +
                                  "' is no class of topics");
    }
  }
}

/// Of this class; what the profile says of the base and the scan is meant for their topics, too.
std::vector<std::string> namesOf(const RobotProfile& robot, const ClassWord& of) {
  const auto listed = robot.topics.find(of.word);
  std::vector<std::string> names =
      listed == robot.topics.end() ? std::vector<std::string>() : listed->second;
  const RobotProfile::Base& base = robot.base;
  if (of.topic_class == TopicClass::Control) {
    names.insert(names.end(), base.take_over_topics.begin(), base.take_over_topics.end());
  }
  const bool is_behind = !base.output_topic.empty() && base.output_topic != base.velocity_topic;
  if (of.topic_class == TopicClass::Other && is_behind) names.push_back(base.output_topic);
  if (of.topic_class == TopicClass::Other && !robot.scan_topic.empty()) {
    names.push_back(robot.scan_topic);  // old ranges hide people
  }
  if (of.topic_class == TopicClass::Body && !base.velocity_topic.empty()) {
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

RobotTopics::RobotTopics(const RobotProfile& robot) : robot_(robot.name) {
  checkWords(robot);
  for (const ClassWord& word : kWords) {
    words_.emplace_back(word.topic_class, namesOf(robot, word));
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

std::string RobotTopics::refusal(std::string_view topic, std::string_view type) const {
  const std::optional<TopicClass> word = wordOf(topic);
  const bool is_permission = word && strictness(*word) == 0;
  const TopicRole role = is_permission ? roleOf(topic, type) : TopicRole();
  if (!is_permission || role.topic_class == *word) return "";
  return "the profile of " + robot_ + " calls it " + std::string(name(*word)) + ", but " +
         (*word == TopicClass::Body ? "how it is stopped is not known" : "it may move something") +
         " (" + std::string(role.why) + ")";
}

}  // namespace afterglow::replay
