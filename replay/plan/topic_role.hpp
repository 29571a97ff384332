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
};

/// Topics that are drawn or heard are Shown, asked for or not; the plan decides about that.
TopicRole roleOf(std::string_view topic, std::string_view type);

}  // namespace afterglow::replay
