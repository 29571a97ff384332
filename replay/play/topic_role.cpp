#include "replay/play/topic_role.hpp"

#include <algorithm>
#include <array>

namespace afterglow::replay {
namespace {

template <std::size_t n>
bool isOneOf(std::string_view text, const std::array<std::string_view, n>& known) {
  return std::find(known.begin(), known.end(), text) != known.end();
}

bool startsWith(std::string_view text, std::string_view start) {
  return text.substr(0, start.size()) == start;
}

bool endsWith(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

std::string_view lastName(std::string_view topic) { return topic.substr(topic.rfind('/') + 1); }

// Types that make a robot move wherever they are sent.
constexpr std::array<std::string_view, 7> kMotionTypes{"geometry_msgs/Twist",
                                                       "geometry_msgs/TwistStamped",
                                                       "trajectory_msgs/JointTrajectory",
                                                       "trajectory_msgs/MultiDOFJointTrajectory",
                                                       "ackermann_msgs/AckermannDrive",
                                                       "ackermann_msgs/AckermannDriveStamped",
                                                       "actionlib_msgs/GoalID"};

// Last names of topics that make a robot move, whatever they carry (a Float64 for one joint's
// controller, a PoseStamped for move_base_simple): `--only ar` must not move anything.
constexpr std::array<std::string_view, 4> kMotionTopics{"command", "commands", "cmd_vel", "goal"};

}  // namespace

std::string_view name(Modality modality) {
  switch (modality) {
    case Modality::Body:
      return "body";
    case Modality::Ar:
      return "ar";
    case Modality::Speech:
      return "speech";
  }
  return "";
}

Modality modalityOf(std::string_view topic, std::string_view type) {
  // sound_play has an action too; its goal speaks, and its cancel is known by the topic alone.
  if (startsWith(type, "sound_play/") || endsWith(topic, "/sound_play/cancel")) {
    return Modality::Speech;
  }
  const bool moves = endsWith(type, "ActionGoal") || startsWith(type, "control_msgs/") ||
                     isOneOf(type, kMotionTypes) || isOneOf(lastName(topic), kMotionTopics);
  return moves ? Modality::Body : Modality::Ar;
}

std::string_view whyNotInRecordedTime(std::string_view topic, std::string_view type) {
  // A second clock would hijack the time of every running node.
  if (topic == "/clock" || type == "rosgraph_msgs/Clock") return "time is not replayed";
  // What nodes said about themselves then is not said by them now.
  if (topic == "/rosout" || topic == "/rosout_agg" || startsWith(type, "rosgraph_msgs/") ||
      startsWith(type, "diagnostic_msgs/")) {
    return "a log of nodes, evidence only";
  }
  return {};
}

std::string_view whyNeverReplayed(std::string_view topic, std::string_view type) {
  const std::string_view last = lastName(topic);
  // Two sources of one transform fight, and old stamps are refused (geometry2 issues 43 and 64).
  if (last == "tf" || last == "tf_static" || endsWith(type, "/TFMessage") ||
      endsWith(type, "/tfMessage")) {
    return "transforms come from the robot itself; recorded ones place the recording";
  }
  if (const auto why = whyNotInRecordedTime(topic, type); !why.empty()) return why;
  // A client would take a recorded answer for that of its own goal.
  if (last == "result" || last == "feedback" || last == "status" ||
      endsWith(type, "ActionResult") || endsWith(type, "ActionFeedback") ||
      type == "actionlib_msgs/GoalStatusArray") {
    return "an answer of the robot; it gives a new one";
  }
  // Controllers and localization would believe the joints and the base to be where they were.
  if (last == "joint_states" || type == "nav_msgs/Odometry") {
    return "the robot's state then; it has another now";
  }
  return {};
}

}  // namespace afterglow::replay
