#include "replay/ros2/action_type.hpp"

#include <algorithm>
#include <initializer_list>
#include <vector>

#include "replay/messages/schema.hpp"
#include "replay/ros2/ros2_definition.hpp"

namespace afterglow::replay {
namespace {

/// A part of an action.
struct PartKind {
  std::string suffix;  ///< "Goal"
  std::string field;   ///< its field, in both ROSes
  std::string head;    ///< the fields before it in ROS 2's message
  std::string topic;   ///< the fields before it in the message of ROS 1's topic
  CdrConversion::Extra extra;
};
const std::string kUuid = "uint8[16] goal_id\n";
const std::string kStatus = "Header header\nactionlib_msgs/GoalStatus status\n";
const PartKind kGoal = {"Goal", "goal", kUuid, "Header header\nactionlib_msgs/GoalID goal_id\n",
                        CdrConversion::Extra::Empty};
const PartKind kResult = {"Result", "result", "int8 status\n", kStatus,
                          CdrConversion::Extra::PassedOver};
const PartKind kFeedback = {"Feedback", "feedback", kUuid, kStatus,
                            CdrConversion::Extra::PassedOver};

std::string section(const std::string& type, const std::string& text) {
  return "\n" + std::string(80, '=') + "\nMSG: " + type + "\n" + text;
}

/// The names in ROS 2 and in ROS 1 of a part's type.
std::string partInRos2(const std::string& type, const PartKind& kind) {
  return type + "_" + kind.suffix;
}
std::string partInRos1(const std::string& type, const PartKind& kind) { return type + kind.suffix; }
std::string topicInRos1(const std::string& type, const PartKind& kind) {
  return type + "Action" + kind.suffix;
}

const std::string& textOf(const ActionText& action, const PartKind& kind) {
  return &kind == &kGoal ? action.goal : &kind == &kResult ? action.result : action.feedback;
}

/// The definition of a part's topic in ROS 1 by that of the part.
std::string topicDefinition(const std::string& type, const PartKind& kind,
                            const std::string& part) {
  const std::string name = partInRos1(type, kind);
  std::string text = kind.topic + name.substr(name.find('/') + 1) + " " + kind.field + "\n";
  if (part.find("MSG: std_msgs/Header\n") == std::string::npos) {
    text += section("std_msgs/Header", "uint32 seq\ntime stamp\nstring frame_id\n");
  }
  if (&kind != &kGoal) {
    text += section("actionlib_msgs/GoalStatus",
                    "GoalID goal_id\nuint8 status\nuint8 PENDING=0\nuint8 ACTIVE=1\n"
                    "uint8 PREEMPTED=2\nuint8 SUCCEEDED=3\nuint8 ABORTED=4\nuint8 REJECTED=5\n"
                    "uint8 PREEMPTING=6\nuint8 RECALLING=7\nuint8 RECALLED=8\nuint8 LOST=9\n"
                    "string text\n");
  }
  return text + section("actionlib_msgs/GoalID", "time stamp\nstring id\n") + section(name, part);
}

/// The definitions that ROS 1 would have if the action were its own.
FindDefinition ownDefinitions(const std::string& type, const ActionText& ros2) {
  return [&type, &ros2](const std::string& asked) -> std::optional<Definition> {
    for (const PartKind* kind : {&kGoal, &kResult, &kFeedback}) {
      const bool is_topic = asked == topicInRos1(type, *kind);
      if (!is_topic && asked != partInRos1(type, *kind)) continue;
      std::string text = ros1Definition(partInRos2(type, *kind), textOf(ros2, *kind));
      if (is_topic) text = topicDefinition(type, *kind, text);
      return Definition{text, definitionMd5(asked, text)};
    }
    return std::nullopt;
  };
}

Definition knownDefinition(const std::string& type, const FindDefinition& find) {
  auto known = find(type);
  if (!known) throw MessageError("no ROS 1 type " + type + " is known here");
  return *known;
}

/// The message of ROS 2 in which a part stands, by the definition of the part in ROS 1's terms.
Schema wholeSchema(const std::string& type, const PartKind& kind, const std::string& name,
                   const std::string& text) {
  return Schema::parse(type, kind.head + name + " " + kind.field + "\n" + section(name, text));
}

Bytes joined(const GoalUuid& uuid, const Bytes& part) {
  Bytes whole(uuid.begin(), uuid.end());
  whole.insert(whole.end(), part.begin(), part.end());
  return whole;
}

std::pair<GoalUuid, Bytes> splitUuid(const Bytes& bytes) {
  GoalUuid uuid;
  const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(uuid.size());
  std::copy(bytes.begin(), end, uuid.begin());
  return {uuid, Bytes(end, bytes.end())};
}

// ------------------------------------------------------------------------------ definitions

const std::string kTrajectoryAction = "control_msgs/FollowJointTrajectory";
const std::string kMultiDofPoint = "trajectory_msgs/MultiDOFJointTrajectoryPoint";

/// control_msgs/FollowJointTrajectory, the fields of which differ from ROS 1's since Foxy. Its
/// contained types do not, but for the header.
std::optional<ActionText> trajectoryAction(const FindDefinition& ros1) {
  bool are_known = true;
  const auto contained = [&](std::initializer_list<std::string> types) {
    std::string text;
    for (const std::string& type : types) {
      const auto known = ros1(type);
      are_known = are_known && known;
      if (known) text += section(type, ros2Definition(type, known->text));
    }
    return text;
  };
  ActionText action;
  action.goal =
      "trajectory_msgs/JointTrajectory trajectory\n"
      "trajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory\n"
      "JointTolerance[] path_tolerance\nJointComponentTolerance[] component_path_tolerance\n"
      "JointTolerance[] goal_tolerance\nJointComponentTolerance[] component_goal_tolerance\n"
      "builtin_interfaces/Duration goal_time_tolerance\n" +
      contained({"trajectory_msgs/JointTrajectory", "trajectory_msgs/MultiDOFJointTrajectory"}) +
      section("control_msgs/JointTolerance",
              "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n") +
      section("control_msgs/JointComponentTolerance",
              "string joint_name\nuint16 component\nfloat64 position\nfloat64 velocity\n"
              "float64 acceleration\n");
  action.result = "int32 error_code\nstring error_string\n";
  action.feedback =
      "std_msgs/Header header\nstring[] joint_names\n"
      "trajectory_msgs/JointTrajectoryPoint desired\ntrajectory_msgs/JointTrajectoryPoint actual\n"
      "trajectory_msgs/JointTrajectoryPoint error\nstring[] multi_dof_joint_names\n" +
      kMultiDofPoint + " multi_dof_desired\n" + kMultiDofPoint + " multi_dof_actual\n" +
      kMultiDofPoint + " multi_dof_error\n" +
      contained({"std_msgs/Header", "trajectory_msgs/JointTrajectoryPoint", kMultiDofPoint});
  return are_known ? std::optional(action) : std::nullopt;
}

std::optional<ActionText> actionOfRos1(const std::string& type, const FindDefinition& ros1) {
  std::vector<std::string> texts;
  for (const PartKind* kind : {&kGoal, &kResult, &kFeedback}) {
    const std::string name = partInRos1(type, *kind);
    const auto known = ros1(name);
    if (!known) return std::nullopt;
    texts.push_back(ros2Definition(name, known->text));
  }
  return ActionText{texts[0], texts[1], texts[2]};
}

}  // namespace

std::optional<ActionText> ros2Action(const std::string& type, const DefinitionFolders& ros2,
                                     const FindDefinition& ros1) {
  if (auto found = ros2.findAction(type)) return found;
  return type == kTrajectoryAction ? trajectoryAction(ros1) : actionOfRos1(type, ros1);
}

std::string actionFeedbackIn(const std::string& definition, const std::string& type) {
  const std::string separator(80, '='), heading = "MSG: " + type + "_Feedback\n";
  const std::size_t contained = definition.find(separator), at = definition.find(heading);
  if (at == std::string::npos || contained > at) {
    throw MessageError("the definition of its feedback's message has no " + type + "_Feedback");
  }
  const std::size_t begin = at + heading.size();
  const std::size_t end = std::min(definition.find(separator, begin), definition.size());
  const std::size_t line = separator.size() + 1;
  return definition.substr(begin, end - begin) +
         definition.substr(contained, at - line - contained) + definition.substr(end);
}

/// Makes the parts of an action.
class ActionPlan {
 public:
  ActionPlan(const std::string& type, const ActionText& ros2) : type_(type), ros2_(ros2) {}

  /// Tells why the parts are not those that ROS 1 knows, if so.
  ActionType::Parts parts(const FindDefinition& ros1, std::string& why_own) const {
    try {
      return parts(ros1);
    } catch (const MessageError& error) {
      why_own = error.what();
    }
    return parts(ownDefinitions(type_, ros2_));
  }

 private:
  ActionType::Parts parts(const FindDefinition& ros1) const {
    return {part(kGoal, "_SendGoal_Request", ros1), part(kResult, "_GetResult_Response", ros1),
            part(kFeedback, "_FeedbackMessage", ros1)};
  }

  ActionType::Part part(const PartKind& kind, const std::string& message,
                        const FindDefinition& ros1) const {
    const std::string topic_type = topicInRos1(type_, kind), name = partInRos1(type_, kind);
    const Definition topic = knownDefinition(topic_type, ros1);
    const std::string fields = knownDefinition(name, ros1).text;
    const std::string ros2_name = partInRos2(type_, kind);
    Ros2Bounds bounds;
    const std::string ros2_fields = ros1Definition(ros2_name, textOf(ros2_, kind), &bounds);
    return {{"", topic_type, topic.md5, topic.text, false, ""},
            {wholeSchema(type_ + message, kind, ros2_name, ros2_fields),
             wholeSchema(type_ + message, kind, name, fields), bounds, kind.extra},
            Bytes(Schema::parse(name, fields).minimumSize(0))};
  }

  const std::string& type_;
  const ActionText& ros2_;
};

ActionType::ActionType(const std::string& type, const ActionText& ros2, const FindDefinition& ros1)
    : parts_(ActionPlan(type, ros2).parts(ros1, why_own_)) {}

Bytes ActionType::goalRequest(const GoalUuid& uuid, const Bytes& ros1) const {
  return parts_.goal.conversion.toRos2(joined(uuid, ros1));
}

std::pair<GoalUuid, Bytes> ActionType::readGoalRequest(const Bytes& cdr) const {
  return splitUuid(parts_.goal.conversion.toRos1(cdr));
}

Bytes ActionType::feedbackMessage(const GoalUuid& uuid, const Bytes& ros1) const {
  return parts_.feedback.conversion.toRos2(joined(uuid, ros1));
}

std::pair<GoalUuid, Bytes> ActionType::readFeedback(const Bytes& cdr) const {
  return splitUuid(parts_.feedback.conversion.toRos1(cdr));
}

Bytes ActionType::resultReply(std::int8_t status, const Bytes& ros1) const {
  Bytes whole{static_cast<std::uint8_t>(status)};
  whole.insert(whole.end(), ros1.begin(), ros1.end());
  return parts_.result.conversion.toRos2(whole);
}

std::pair<std::int8_t, Bytes> ActionType::readResultReply(const Bytes& cdr) const {
  const Bytes whole = parts_.result.conversion.toRos1(cdr);
  return {static_cast<std::int8_t>(whole.front()), Bytes(whole.begin() + 1, whole.end())};
}

}  // namespace afterglow::replay
