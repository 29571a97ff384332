/// \file
/// The drivers of a recorded velocity topic, as the nodes around it tell: a program, a person or a
/// multiplexer. It never permits more than the topic's name and type do. Source: what
/// teleop_twist_joy, twist_mux, yocs_cmd_vel_mux, topic_tools mux and velocity smoothers subscribe
/// to.
/// Goals and commands of which one was sent because of the other: /cmd_vel by move_base for its
/// goal, a controller's goal by MoveIt for /execute_trajectory/goal. Of the two, one is played.
/// Source: who publishes and who hears what in move_base, move_group, play_motion,
/// parallel_gripper_fake, pr2_head_action, pr2_gripper_action.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/plan/play_plan.hpp"
#include "replay/plan/topic_role.hpp"
#include "replay/record/snapshot.hpp"

namespace afterglow::replay {

struct RecordedDriver {
  TopicClass topic_class;  ///< Control or Other
  std::string why;         ///< a clause for people
};

/// Returns the driver of a velocity topic. Control if only nodes sent on it by which a person
/// drives: called so (teleop, joy, keyboard), or hearing a joystick. Other if only multiplexers
/// did, which hear several other velocities or a recorded one, and not this one: behind them nobody
/// can override a replay. Else empty, as for topics that nothing was noted of, and in imports,
/// which know the senders alone.
std::optional<RecordedDriver> driverOf(const std::string& topic, const RecordedNodes& nodes,
                                       const std::vector<std::string>& recorded);

/// Returns true if it was noted who sent it, and who heard it; not in imports.
bool isDriverNoted(const std::string& topic, const RecordedNodes& nodes);

/// Returns true if it was noted that no node heard it; not in imports.
bool wasUnheard(const std::string& topic, const RecordedNodes& nodes);

/// Returns the nodes that sent a velocity, and behind smoothers and multiplexers those that sent
/// theirs.
std::set<std::string> driversBehind(const std::string& topic, const RecordedNodes& nodes);

/// geometry_msgs/Twist and TwistStamped.
bool isTwist(const std::string& type);

/// Twist, TwistStamped, AckermannDrive and AckermannDriveStamped.
bool isBaseVelocity(const std::string& type);

/// Returns true for velocities and joysticks: topics that tell who drove, recorded or not.
bool tellsWhoDrove(const std::string& type);

/// The lower one was sent by the node that serves the higher goal's action; where nothing was
/// noted, known names tell. The lowest is played, but of an action and the bare command of its own
/// controller the action, whose end is told; and what is named by whoever replays instead of what
/// is not. If both are named, the higher one is refused.
void leaveOutNested(std::vector<PlannedTopic>& topics, const RecordedNodes& nodes);

}  // namespace afterglow::replay
