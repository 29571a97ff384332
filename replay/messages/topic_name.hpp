/// \file
/// Names of topics as ROS 1 has them. Source: wiki.ros.org/Names; ros::names::validate and clean.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "replay/messages/text.hpp"

namespace afterglow::replay {

/// A name that exists only absolute, valid by the rules of ROS graph names, and clean: one slash
/// between its parts, none at its end. Two of them are the same topic only if they are equal.
class TopicName {
 public:
  static constexpr std::size_t kLongest = 255;  ///< bytes

  // A text becomes a name where one is asked for. Throws std::invalid_argument, one line, for what
  // is none: "'//joy' is no clean name: '/joy' is", "'joy' is no topic: it begins with no slash".
  TopicName(const std::string& text);
  TopicName(const char* text) : TopicName(std::string(text)) {}
  TopicName(std::string_view text) : TopicName(std::string(text)) {}

  /// The name that a recorded topic is judged and published by; none: ROS has no such topic.
  static std::optional<TopicName> cleaned(std::string_view recorded);

  /// The name below a namespace, which is clean ("/robot1") or none ("" or "/"). Throws as the
  /// constructor for any other one, and for a name that becomes too long.
  TopicName in(const std::string& name_space) const;

  const std::string& text() const { return text_; }

  friend bool operator==(const TopicName& a, const TopicName& b) { return a.text_ == b.text_; }
  friend bool operator!=(const TopicName& a, const TopicName& b) { return a.text_ != b.text_; }
  friend bool operator<(const TopicName& a, const TopicName& b) { return a.text_ < b.text_; }

 private:
  std::string text_;
};

/// Makes a name of each text; throws as TopicName.
std::vector<TopicName> topicNames(const std::vector<std::string>& texts);

/// Types that mean something to recorder, player and story.
inline constexpr const char* kSoundRequestType = "sound_play/SoundRequest";
inline constexpr const char* kGoalIdType = "actionlib_msgs/GoalID";

/// "/arm" for "/arm/goal"; empty for a topic of any other name.
std::string actionOfGoal(const std::string& topic);
/// "/arm" of "/arm/goal", "/arm/cancel", "/arm/result".
std::string actionOf(const std::string& topic);

/// Throws std::invalid_argument, as TopicName, for a text that is neither empty nor a namespace,
/// "/robot1": a slash alone is none, as it changes no name.
void checkNamespace(const std::string& text);

}  // namespace afterglow::replay
