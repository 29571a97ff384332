#include "replay/motion/robot_joints.hpp"

#include "replay/messages/ranges.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {
namespace {

bool speaksOf(const std::string& name, const char* part) {
  return name.find(part) != std::string::npos;
}

bool isGripperByName(const std::string& joint) {
  return speaksOf(joint, "gripper") || speaksOf(joint, "finger");
}

}  // namespace

RobotJoints::RobotJoints(std::string robot_name, std::map<std::string, RobotJoint> joints,
                         std::vector<std::string> gripper)
    : robot_name_(std::move(robot_name)),
      joints_(std::move(joints)),
      gripper_(std::move(gripper)) {}

const RobotJoint* RobotJoints::find(const std::string& joint) const {
  const auto known = joints_.find(joint);
  return known == joints_.end() ? nullptr : &known->second;
}

bool RobotJoints::isSliding(const std::string& joint) const {
  if (const RobotJoint* known = find(joint)) return known->kind == RobotJoint::Kind::Sliding;
  return isGripperByName(joint) || speaksOf(joint, "torso");
}

bool RobotJoints::isEndless(const std::string& joint) const {
  const RobotJoint* known = find(joint);
  return known && known->kind == RobotJoint::Kind::Endless;
}

bool RobotJoints::isGripper(const std::string& joint) const {
  return gripper_.empty() ? isGripperByName(joint) : contains(gripper_, joint);
}

const MimicJoint* RobotJoints::mimicOf(const std::string& joint) const {
  const RobotJoint* known = find(joint);
  return known && known->mimic ? &*known->mimic : nullptr;
}

double RobotJoints::way(const std::string& joint, double then, double now) const {
  return isEndless(joint) ? wrapAngle(now - then) : now - then;
}

}  // namespace afterglow::replay
