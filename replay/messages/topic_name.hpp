/// \file
/// Names of topics as ROS 1 has them. Source: wiki.ros.org/Names; ros::names::validate and clean.
///
/// The names of a robot that is one of several: its topics lie in a namespace, its frames begin
/// with a prefix. Also the names of a recorded robot on today's.
#pragma once

#include <cstddef>
#include <functional>
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

/// Default: a robot alone, whose names are global.
struct RobotNames {
  std::string name_space;    ///< "/robot1"; empty: global
  std::string frame_prefix;  ///< "robot1" of robot1/base_link; empty: none

  /// A topic as profiles and defaults call it, "/odom", as this robot has it: "/robot1/odom". What
  /// all robots share (tf, the map, time, diagnostics) and what lies in the namespace stays.
  std::string topic(const std::string& usual) const;
  /// "base_link" as this robot has it: "robot1/base_link". Frames of the world (map, world, earth)
  /// and those with the prefix stay.
  std::string frame(const std::string& usual) const;

  friend bool operator==(const RobotNames& a, const RobotNames& b) {
    return a.name_space == b.name_space && a.frame_prefix == b.frame_prefix;
  }
  friend bool operator!=(const RobotNames& a, const RobotNames& b) { return !(a == b); }
};

/// A name without its leading slash, as tf2 has frames.
std::string bareName(const std::string& name);

/// "robot1", "/robot1/" and "/robot1" are "/robot1"; "/" is empty.
std::string cleanNamespace(const std::string& text);

/// The robot in that namespace: its prefix is the first that tf knows of `said` (ROS's parameter
/// tf_prefix; may be empty, slashes around it do not count), the namespace's name and that with
/// "_tf" behind it. If tf knows neither these nor the frames without one, it is `said`.
RobotNames findRobotNames(const std::string& name_space, const std::string& said,
                          const std::function<bool(const std::string& frame)>& is_known);

/// The recorded robot's names on today's robot. Names that are not the robot's own stay.
struct RobotRenaming {
  RobotNames recorded, live;

  std::string topic(const std::string& name) const;
  std::string frame(const std::string& name) const;
  bool renamesFrames() const { return recorded.frame_prefix != live.frame_prefix; }
};

/// Returns the renaming to the robot in that namespace. Its prefix is `said`; if that is empty, it
/// is called after the namespace as the recorded one is: "robot1_tf" becomes "robot2_tf".
RobotRenaming renamingTo(const RobotNames& recorded, const std::string& name_space,
                         const std::string& said);

}  // namespace afterglow::replay
