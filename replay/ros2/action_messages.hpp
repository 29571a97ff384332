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
#include <utility>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// An action's services in ROS 2, and its topics in ROS 1, of which ROS 2 has status and feedback.
enum class ActionService { SendGoal, GetResult, CancelGoal };
enum class ActionTopic { Goal, Cancel, Status, Feedback, Result };

/// The relays of actions count time in ticks.
constexpr int kActionTicksPerSecond = 5;
/// As long as actionlib's servers keep what has ended in their status; so long may a result come
/// after the status that ends its goal.
constexpr int kEndedTicks = 5 * kActionTicksPerSecond;
/// The longest that a server may take to accept or to reject a goal.
constexpr int kPatienceTicks = 30 * kActionTicksPerSecond;

/// The identity of a request in DDS: its writer, and its number there.
struct RequestId {
  std::array<std::uint8_t, 16> writer{};
  std::int64_t number = 0;
  friend bool operator==(const RequestId& a, const RequestId& b) {
    return a.writer == b.writer && a.number == b.number;
  }
};

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
  Recalled,
  Lost
};

/// The state in ROS 1 of action_msgs/GoalStatus.status; empty for STATUS_UNKNOWN and for a number
/// that is no state.
std::optional<GoalState> goalStateOf(std::int8_t ros2_status);
/// The other way round. ROS 2 has a rejection in the reply to a goal alone: a later one aborts it.
std::int8_t ros2StatusOf(GoalState state);
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
std::pair<ActionGoalStatus, Bytes> readActionUpdate(const Bytes& ros1);
Bytes statusListMessage(Stamp now, const std::vector<ActionGoalStatus>& goals);
std::vector<ActionGoalStatus> readStatusListMessage(const Bytes& ros1);
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
Bytes goalReply(bool is_accepted, Stamp stamp);
bool readIsAccepted(const Bytes& send_goal_reply);
Bytes resultRequest(const GoalUuid& uuid);
GoalUuid readResultRequest(const Bytes& cdr);
Bytes cancelRequest(const GoalUuid& uuid);
GoalInfo readCancelRequest(const Bytes& cdr);
/// action_msgs/CancelGoal's return code.
enum class CancelCode : std::int8_t { Canceling, Rejected, UnknownGoal, GoalHasEnded };
Bytes cancelReply(CancelCode code, const std::vector<GoalInfo>& canceling);
CancelCode readCancelReply(const Bytes& cdr);
Bytes statusList(const std::vector<Ros2GoalStatus>& goals);
std::vector<Ros2GoalStatus> readStatusList(const Bytes& cdr);

}  // namespace afterglow::replay
