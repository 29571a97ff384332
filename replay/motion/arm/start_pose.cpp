#include "replay/motion/arm/start_pose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "replay/messages/document.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/motion/base/track_reader.hpp"
#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/joint_track.hpp"
#include "replay/plan/permission.hpp"

namespace afterglow::replay {
namespace {

const std::string kNotLocalized = "it was recorded without localization (map -> odom)";

void addGoal(const PlannedTopic& topic, const Bytes& bytes, const Schema& schema,
             std::optional<JointGoals>& goals) {
  Value document = decode(schema, bytes);
  std::vector<std::string> joints;
  if (const auto trajectory = trajectoryIn(document)) {
    joints = trajectory->joints;
  } else if (!isGripperGoal(topic.channel)) {
    return;
  }
  if (!goals) goals = JointGoals{topic.output, bytes, {}};
  for (const std::string& joint : joints) {
    if (!contains(goals->joints, joint)) goals->joints.push_back(joint);
  }
}

std::optional<JointGoals> readGoals(const Store& store, const PlayPlan& plan,
                                    const PlannedTopic& topic) {
  std::optional<JointGoals> goals;
  const Schema schema = Schema::of(topic.channel);
  const auto cursor = store.messages(plan.behavior, {{topic.channel.topic}, {}, plan.end});
  while (const auto message = cursor->next()) {
    try {
      addGoal(topic, message->bytes, schema, goals);
    } catch (const MessageError&) {
      continue;
    }
  }
  return goals;
}

/// Returns the moved parts' joints.
std::map<std::string, double> movedJoints(const Store& store, const PlayPlan& plan,
                                          const MovedParts& parts, Stamp at, const char* when,
                                          std::vector<std::string>& remarks) {
  std::map<std::string, double> moved;
  const std::map<std::string, double> recorded =
      JointTrack::read(store, plan.behavior, at, at).at(at);
  for (const std::string& joint : parts.joints()) {
    const auto found = recorded.find(joint);
    if (found != recorded.end()) {
      moved.insert(*found);
    } else {
      remarks.push_back("the position of " + joint + " " + when + " was not recorded");
    }
  }
  for (const auto& [joint, position] : recorded) {
    if (parts.movesGripper() && parts.robot.isGripper(joint)) moved.emplace(joint, position);
  }
  return moved;
}

void readBase(const Store& store, const PlayPlan& plan, const TrackFrames& frames, StartPose& pose,
              std::vector<std::string>& remarks) {
  std::string why;
  const auto track =
      readPoseTrack(store, aroundMoments(plan.behavior, plan.begin, plan.begin), frames,
                    LocalizationNoise(), why);
  if (track && track->isLocalized()) {
    pose.base = track->at(plan.begin);
    const PoseError &known = track->begin_error, &one = track->measured_error;
    if (one.position > 0) pose.base_share.position = known.position / one.position;
    if (one.yaw > 0) pose.base_share.yaw = known.yaw / one.yaw;
    return;
  }
  remarks.push_back("where the base stood at the start is not known: " +
                    (track ? kNotLocalized : why));
}

}  // namespace

bool isGripperGoal(const Channel& channel) {
  return channel.type == "control_msgs/GripperCommandActionGoal";
}

// --------------------------------------------------------------------------------- what it moves

bool MovedParts::movesGripper() const {
  return anyOf(goals, [](const JointGoals& goal) { return goal.joints.empty(); });
}

std::vector<std::string> MovedParts::joints() const {
  std::set<std::string> joints;
  for (const JointGoals& goal : goals) joints.insert(goal.joints.begin(), goal.joints.end());
  return {joints.begin(), joints.end()};
}

MovedParts movedParts(const Store& store, const PlayPlan& plan, const RobotJoints& robot) {
  MovedParts parts;
  parts.robot = robot;
  for (const PlannedTopic& topic : plan.topics) {
    if (!topic.movesBody()) continue;
    const MotionStop stop = stopOf(topic);
    if (isVelocity(topic.channel) || stop.kind == StopKind::Speed) {
      parts.moves_base = parts.moves_base || topic.count > 0;
      continue;
    }
    if (stop.isSetPoint() && topic.count > 0) parts.unnamed.push_back(topic.output.topic);
    // A target that a rule's cancel stops is the same from anywhere.
    const bool is_target = stop.kind == StopKind::Cancel && !isGoal(topic.channel);
    if (stop.isSetPoint() || is_target) continue;
    parts.moves_joints = parts.moves_joints || topic.count > 0;
    if (auto goals = readGoals(store, plan, topic)) parts.goals.push_back(std::move(*goals));
  }
  return parts;
}

StartPose readStartPose(const Store& store, const PlayPlan& plan, const MovedParts& parts,
                        std::vector<std::string>& remarks, const TrackFrames& frames) {
  StartPose pose;
  pose.robot = parts.robot;
  pose.joints = movedJoints(store, plan, parts, plan.begin, "at the start", remarks);
  std::vector<std::string> unsaid;  // an arm may stand on a base that nobody localizes
  if (parts.moves_base || parts.moves_joints) {
    readBase(store, plan, frames, pose, parts.moves_base ? remarks : unsaid);
  }
  return pose;
}

StartPose readEndPose(const Store& store, const PlayPlan& plan, const MovedParts& parts, Stamp at,
                      std::vector<std::string>& remarks, const TrackFrames& frames) {
  StartPose pose;
  pose.robot = parts.robot;
  pose.joints = movedJoints(store, plan, parts, at, "at the end", remarks);
  if (!parts.moves_base) return pose;
  std::string why;
  const auto track =
      readPoseTrack(store, plan.behavior, frames, LocalizationNoise(), why, plan.begin, plan.end);
  if (track && track->isLocalized()) {
    pose.base = track->endPose();
  } else {
    remarks.push_back("where the base stood at the end is not known: " +
                      (track ? kNotLocalized : why));
  }
  return pose;
}

// ------------------------------------------------------------------------------------ deviations

double toleranceOf(const RobotJoints& robot, const std::string& joint,
                   const StartTolerances& tolerances) {
  return robot.isGripper(joint)   ? tolerances.gripper
         : robot.isSliding(joint) ? tolerances.sliding
                                  : tolerances.turning;
}

std::string deviationText(const RobotJoints& robot, const std::string& joint, double off,
                          double then, double now) {
  const int digits = robot.isSliding(joint) ? 3 : 2;
  return fmt::format("{} is {:.{}f} {} off (now {:.{}f}, then {:.{}f})", joint, off, digits,
                     robot.isSliding(joint) ? "m" : "rad", now, digits, then, digits);
}

double ApproachSpeed::of(const RobotJoints& robot, const std::string& joint) const {
  const double most = robot.isSliding(joint) ? sliding : turning;
  const auto known = robot.all().find(joint);
  const bool is_slower = known != robot.all().end() && known->second.fastest;
  return is_slower ? std::min(most, *known->second.fastest) : most;
}

std::vector<std::string> jointDeviations(const StartPose& then, const StartPose& now,
                                         const StartTolerances& tolerances) {
  std::multimap<double, std::string, std::greater<>> farthest;  // by tolerances
  for (const auto& [joint, position] : then.joints) {
    if (then.robot.mimicOf(joint)) continue;
    const auto live = now.joints.find(joint);
    if (live == now.joints.end()) {
      farthest.emplace(std::numeric_limits<double>::infinity(), "nobody tells where " + joint + " is");
      continue;
    }
    const double off = std::abs(then.robot.way(joint, position, live->second));
    const double tolerance = toleranceOf(then.robot, joint, tolerances);
    if (off <= tolerance) continue;
    farthest.emplace(off / tolerance,
                     deviationText(then.robot, joint, off, position, live->second));
  }
  std::vector<std::string> deviations;
  for (const auto& [off, deviation] : farthest) deviations.push_back(deviation);
  return deviations;
}

std::string whyElsewhere(const std::vector<std::string>& joints, const std::string& base,
                         bool goes_there) {
  if (joints.empty() && base.empty()) return "";
  std::string why = "the robot does not stand as it did: ";
  const bool counts = !base.empty() && joints.size() > 1;
  why += counts ? std::to_string(joints.size()) + " joints are off" : someOf(joints);
  if (!base.empty()) why += (joints.empty() ? "" : "; ") + base + "; the base has to be brought there";
  return goes_there ? why : why + (base.empty() ? "; " : ", or ") + "--to-start takes it there";
}

std::string baseDeviation(const StartPose& then, const StartPose& now,
                          const StartTolerances& tolerances) {
  if (!then.base) {
    return "";
  }
  if (!now.base) {
    return "nobody tells where the base is (tf)";
  }
  const PlanarPose way = between(*now.base, *then.base);
  const double off = std::hypot(way.x, way.y), turn = std::abs(way.yaw);
  if (off <= tolerances.base && turn <= tolerances.base_turn) {
    return "";
  }
  return fmt::format(
      "the base is {:.2f} m and {:.1f} deg off (then {:.2f} m {} and {:.2f} m to the {}, turned "
      "{})",
      off, turn * kDegreesPerRadian, std::abs(way.x), way.x < 0 ? "behind" : "ahead",
      std::abs(way.y), way.y < 0 ? "right" : "left", way.yaw < 0 ? "right" : "left");
}

std::string baseDeviationAtALook(const StartPose& then, const StartPose& now,
                                 const StartTolerances& tolerances) {
  constexpr PoseError kOneLook{0.05, 0.05};  // m, rad
  const std::string deviation = baseDeviation(then, now, widened(tolerances, kOneLook));
  if (deviation.empty()) return "";
  return deviation + ", where joints lead elsewhere (" +
         (now.base ? "--start-tolerance base=M base_turn=RAD" : "--any-start") + " allows it)";
}

StartTolerances widened(StartTolerances tolerances, const PoseError& doubt) {
  constexpr double kWidest = 0.1, kWidestTurn = 0.1;  // m, rad
  tolerances.base += std::min(doubt.position, kWidest);
  tolerances.base_turn += std::min(doubt.yaw, kWidestTurn);
  return tolerances;
}

}  // namespace afterglow::replay
