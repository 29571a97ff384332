/// \file
/// The role of a recorded topic in a replay: who would act on it if it was published again, and to
/// which of the three modalities it belongs. A topic that is not known to be harmless is not
/// published unless it is named.
/// Source of the roles: the sources of the Fetch's, TIAGo's, PR2's, TurtleBots' and UR's packages,
/// MoveIt and navigation; actionlib's five topics an action; tf2; the troubles that users of rosbag
/// play have with replayed /tf.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "replay/plan/motion_stop.hpp"

namespace afterglow::replay {

/// The body moves, light is drawn on the world, speech is heard.
enum class Modality { Body, Ar, Speech };

/// "body", "ar", "speech".
std::string_view name(Modality modality);

/// `topic` absolute, `type` "package/Type". Topics that neither move a robot nor speak are Ar.
Modality modalityOf(std::string_view topic, std::string_view type);

/// Who would act on a topic.
enum class TopicClass {
  Body,     ///< a robot moves, and the player knows how to stop it
  Shown,    ///< people see or hear it, if a recording or a projector's layer asks for it
  Control,  ///< a robot obeys: the input of an operator, a runstop or a safety device
  Endless,  ///< a robot moves, and nothing stops it when the player is gone: never published
  Other     ///< unknown
};

/// "body", "shown", "control input", "endless motion", "other".
std::string_view name(TopicClass topic_class);

struct TopicRole {
  TopicClass topic_class = TopicClass::Other;
  std::string_view why;  ///< one clause, for people
  StopKind stop = StopKind::None;  ///< of what moves a robot
};

/// Topics by their last names and their types.
struct TopicRow {
  std::vector<std::string_view> names;  ///< as of isCalled(); empty: any
  std::vector<std::string_view> types;  ///< "package/Type", * for any characters; empty: any
  TopicRole role;
  bool is_by_name = false;  ///< of the body, but played only if whoever replays names it

  bool holds(std::string_view topic, std::string_view type) const;
};

/// Whether a topic ends with these names, in which * stands for any characters, slashes too:
/// "base/cmd_vel" fits /base/cmd_vel and /robot/base/cmd_vel, "/base/cmd_vel" the first alone.
bool isCalled(std::string_view topic, std::string_view pattern);

/// The table of all robots: the first row that fits counts. Plan, player, `afterglow play
/// --classes` and the README have their classes from here.
const std::vector<TopicRow>& topicTable();

/// By that table. Topics that are drawn or heard are Shown, asked for or not; the plan decides
/// about that. Of a certain robot: RobotTopics.
TopicRole roleOf(std::string_view topic, std::string_view type);

/// TopicRow::is_by_name.
bool isByName(std::string_view topic, std::string_view type);

/// The types of all that moves the body by its type or name, as patterns: `*` stands for anything.
std::vector<std::string_view> bodyTypes();

/// How motion on a topic is stopped, whatever its class is.
StopKind knownStop(std::string_view topic, std::string_view type);

}  // namespace afterglow::replay
