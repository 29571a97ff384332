/// \file
/// What a recorded topic is to a replay: something to be sent again, and then to which of the three
/// modalities it belongs, or something that was only recorded to be known.
/// Source of the roles: actionlib's five topics an action, tf2, rosbag play's users' troubles with
/// replayed /tf, and the interfaces that move, speak and draw on common robots.
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

/// Why a topic is never published again on a live robot; empty if it may be. One clause, for
/// people.
std::string_view whyNeverReplayed(std::string_view topic, std::string_view type);

/// The same where recorded time is played as well, as rosbag play --clock does: states, answers and
/// transforms of then fit it.
std::string_view whyNotInRecordedTime(std::string_view topic, std::string_view type);

inline bool isReplayable(std::string_view topic, std::string_view type) {
  return whyNeverReplayed(topic, type).empty();
}

}  // namespace afterglow::replay
