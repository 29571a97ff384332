/// \file
/// The table of what is published, by a topic's kind, who named it, and what the robot's owner
/// permits. Plan, dry run, player, console, `afterglow play --classes` and the README have it from
/// here.
///
/// The wording of a refusal: what is wrong and by how much, what helps; three short sentences at
/// most.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace afterglow::replay {

/// The meaning of a topic for a replay.
enum class TopicKind {
  Body,         ///< motion whose stop is known, or said by a rule
  NamedMotion,  ///< likewise, but of an action or behind a multiplexer: never by itself
  Shown,        ///< light and speech
  Other,        ///< states, sensors, answers and what nobody knows
  Control,      ///< the input of an operator, a runstop or a safety device
  Endless,      ///< moves or may move something, and no stop is known
  Forbidden     ///< no ROS topic, or one that this replay obeys
};

/// The person or program that asked for a topic by name; the later one counts.
enum class NamedBy {
  Nobody,
  Recording,  ///< the recording's request, one by one; for what is shown, a running projector, too
  Owner,      ///< a parameter of the player, the rules, the robot's profile
  Replayer    ///< --also, --topics, a goal's options
};

/// The destination of a replay: beside a robot, or names that no robot is live under.
enum class ReplayPlace { Robot, Elsewhere };

struct PermissionCase {
  TopicKind kind = TopicKind::Other;
  NamedBy named_by = NamedBy::Nobody;
  bool is_motion_allowed = false;  ///< option --allow-motion, ~allow_motion
  ReplayPlace place = ReplayPlace::Robot;
};

enum class Verdict {
  Publish,
  Warn,      ///< published, and told before
  LeaveOut,  ///< the rest is played
  AskOwner,  ///< the whole replay is refused until the owner allows motion
  Refuse     ///< the whole replay is refused until the topic is excluded
};

Verdict verdictOf(const PermissionCase& topic);

/// The table for people, in Markdown.
std::string permissionTable();

/// Motion that may not begin, or go on. `why`: a clause.
struct MotionRefused : std::runtime_error {
  explicit MotionRefused(const std::string& clause)
      : std::runtime_error("motion is refused: " + clause), why(clause) {}
  std::string why;
};

/// The first names, and the number of the others: "a, b and 5 more".
std::string someOf(const std::vector<std::string>& names, std::size_t most = 2);

}  // namespace afterglow::replay
