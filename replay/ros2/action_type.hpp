/// \file
/// An action's type in ROS 2 and in ROS 1, and its messages from one to the other. Internal to
/// replay. Sources: genaction (actionlib_msgs) for the types of ROS 1's topics;
/// design.ros2.org/articles/actions.html for those of ROS 2's services.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "replay/messages/definitions.hpp"
#include "replay/messages/message.hpp"
#include "replay/ros2/action_messages.hpp"
#include "replay/ros2/cdr_conversion.hpp"

namespace afterglow::replay {

/// The definition in ROS 2 of an action "package/Type", which its server does not tell (its node
/// knows the types of services, its readers and writers name those of messages): its .action file,
/// the known one, or ROS 1's action of that name, in this order. Empty: there is none.
std::optional<ActionText> ros2Action(const std::string& type, const DefinitionFolders& ros2,
                                     const FindDefinition& ros1);

/// The feedback in the definition of its message, `type` + "_FeedbackMessage", which the server's
/// node does tell: control_msgs 6.3 gave that of FollowJointTrajectory new fields. Throws
/// MessageError if there is none.
std::string actionFeedbackIn(const std::string& definition, const std::string& type);

/// An action. On ROS 1 it has the types that ROS 1 knows by its name, if their fields go with ROS
/// 2's: CdrConversion's rules hold; of fields that ROS 2 alone has, those of a goal have to be
/// empty and those of results and feedback are lost. Else it has ROS 2's fields under the same
/// names, so that nobody who knows other ones is connected. A value; safe from any thread.
class ActionType {
 public:
  /// `type` is "control_msgs/FollowJointTrajectory". Throws MessageError if ROS 1 cannot have it.
  ActionType(const std::string& type, const ActionText& ros2, const FindDefinition& ros1);

  // ROS 1's topics, without their names.
  const Channel& goal() const { return parts_.goal.channel; }
  const Channel& result() const { return parts_.result.channel; }
  const Channel& feedback() const { return parts_.feedback.channel; }
  /// The reason why it has ROS 2's fields; empty: it has those that ROS 1 knows.
  const std::string& whyOwn() const { return why_own_; }
  /// A result without content, as ROS 1 serializes it.
  const Bytes& noResult() const { return parts_.result.nothing; }

  // The bytes of ROS 1 are those of a goal, result or feedback itself. All throw MessageError.
  Bytes goalRequest(const GoalUuid& uuid, const Bytes& ros1) const;
  std::pair<GoalUuid, Bytes> readGoalRequest(const Bytes& cdr) const;
  Bytes feedbackMessage(const GoalUuid& uuid, const Bytes& ros1) const;
  std::pair<GoalUuid, Bytes> readFeedback(const Bytes& cdr) const;
  // With action_msgs/GoalStatus.status.
  Bytes resultReply(std::int8_t status, const Bytes& ros1) const;
  std::pair<std::int8_t, Bytes> readResultReply(const Bytes& cdr) const;

 private:
  friend class ActionPlan;
  struct Part {
    Channel channel;           ///< ROS 1's topic
    CdrConversion conversion;  ///< conversion of the part behind its goal's id, or status
    Bytes nothing;             ///< the part without content
  };
  struct Parts {
    Part goal, result, feedback;
  };

  std::string why_own_;
  Parts parts_;
};

}  // namespace afterglow::replay
