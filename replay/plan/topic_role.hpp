/// \file
/// What a recorded topic is to a replay: who would act on it if it was published again, and by
/// which of the three modalities it is chosen. What is not known to be harmless is not published
/// unless somebody names it.
/// Source of the roles: the sources of the Fetch's, TIAGo's, PR2's, TurtleBots' and UR's packages,
/// MoveIt and navigation; actionlib's five topics an action; tf2; the troubles that users of rosbag
/// play have with replayed /tf.
#pragma once

#include <string>
#include <string_view>

namespace afterglow::replay {

/// The body moves, light is drawn on the world, speech is heard.
enum class Modality { Body, Ar, Speech };

/// "body", "ar", "speech".
std::string_view name(Modality modality);

/// `topic` absolute, `type` "package/Type". What cannot move a robot and does not speak is Ar.
Modality modalityOf(std::string_view topic, std::string_view type);

/// Who would act on a topic.
enum class TopicClass {
  Body,     ///< a robot, by motion whose stop the player knows
  Shown,    ///< people: drawn or heard, where somebody asked for it to be
  Control,  ///< a robot, by what is somebody's input, a runstop's or a safety device's
  Endless,  ///< a robot, by motion that nothing stops when the player is gone: never published
  Other     ///< anybody
};

/// "body", "shown", "control input", "endless motion", "other".
std::string_view name(TopicClass topic_class);

struct TopicRole {
  TopicClass topic_class = TopicClass::Other;
  std::string_view why;  ///< one clause, for people
};

/// What is drawn or heard is Shown, whether or not somebody asked for it: the plan knows that.
TopicRole roleOf(std::string_view topic, std::string_view type);

}  // namespace afterglow::replay
