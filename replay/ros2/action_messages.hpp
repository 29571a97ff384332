/// \file
/// The messages that all actions have in common, of ROS 2 (action_msgs, unique_identifier_msgs;
/// CDR) and of ROS 1 (actionlib_msgs). Sources: their definitions;
/// design.ros2.org/articles/actions.html; wiki.ros.org/actionlib/DetailedDescription.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// The id of a goal in ROS 2.
using GoalUuid = std::array<std::uint8_t, 16>;
/// The id that names no goal: in a cancel it means all of them.
constexpr GoalUuid kNoGoal{};

/// The id in ROS 1 of a goal of ROS 2: 32 hex digits.
std::string goalIdOf(const GoalUuid& uuid);
/// Empty if the id is not one of goalIdOf().
std::optional<GoalUuid> goalUuidOf(std::string_view id);

/// actionlib_msgs/GoalStatus.status.
enum class GoalState : std::uint8_t {
  Pending,
  Active,
  Preempted,
  Succeeded,
  Aborted,
  Rejected,
  Preempting,
  Recalling,
  Recalled
};

/// The state in ROS 1 of action_msgs/GoalStatus.status; empty for STATUS_UNKNOWN and for a number
/// that is no state.
std::optional<GoalState> goalStateOf(std::int8_t ros2_status);
bool isFinal(GoalState state);

/// actionlib_msgs/GoalID.
struct ActionGoalId {
  Stamp stamp;
  std::string id;
};

/// actionlib_msgs/GoalStatus.
struct ActionGoalStatus {
  ActionGoalId goal;
  GoalState state = GoalState::Pending;
  std::string text;
};

/// An action's goal message as its id and the bytes of the goal itself.
struct ActionGoal {
  ActionGoalId id;
  Bytes goal;
};

// ROS 1's bytes. Headers have no frame, and `seq` 0. Reading throws MessageError.
Bytes actionGoalMessage(Stamp now, const ActionGoal& goal);
ActionGoal readActionGoal(const Bytes& ros1);
/// The message of a result or feedback, whose own bytes are `part`.
Bytes actionUpdateMessage(Stamp now, const ActionGoalStatus& status, const Bytes& part);
Bytes statusListMessage(Stamp now, const std::vector<ActionGoalStatus>& goals);
Bytes goalIdMessage(const ActionGoalId& id);
ActionGoalId readGoalId(const Bytes& ros1);

/// action_msgs/GoalInfo.
struct GoalInfo {
  GoalUuid uuid{};
  Stamp stamp;
};
/// action_msgs/GoalStatus.
struct Ros2GoalStatus {
  GoalInfo goal;
  std::int8_t status = 0;
};

// ROS 2's bytes. Reading throws MessageError.
bool readIsAccepted(const Bytes& send_goal_reply);
Bytes resultRequest(const GoalUuid& uuid);
Bytes cancelRequest(const GoalUuid& uuid);
GoalInfo readCancelRequest(const Bytes& cdr);
/// action_msgs/CancelGoal's return code; 0: goals are canceled.
std::int8_t readCancelReply(const Bytes& cdr);
std::vector<Ros2GoalStatus> readStatusList(const Bytes& cdr);

}  // namespace afterglow::replay
