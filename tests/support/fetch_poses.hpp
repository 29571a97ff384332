/// \file
/// Poses of a Fetch and of its links.
#pragma once

#include "nodes/fetch/robot_model.hpp"

namespace afterglow::test {

/// Gripper down, 0.2 m above a 0.72 m table, 0.75 m ahead.
inline nodes::JointPositions armOverTable() {
  return {{"torso_lift_joint", 0.3},        {"shoulder_pan_joint", 0.0},
          {"shoulder_lift_joint", -0.6233}, {"upperarm_roll_joint", 0.0},
          {"elbow_flex_joint", 0.8317},     {"forearm_roll_joint", 0.0},
          {"wrist_flex_joint", 1.3624},     {"wrist_roll_joint", 0.0}};
}

/// Of every link in the root; joints missing from `positions` rest.
inline nodes::LinkPoses linkPoses(const nodes::RobotModel& model,
                                  const nodes::JointPositions& positions) {
  nodes::LinkPoses poses = {{model.rootLink(), Eigen::Isometry3d::Identity()}};
  for (const nodes::Joint& joint : model.joints()) {
    poses[joint.child] = model.linkPose(joint.child, positions);
  }
  return poses;
}

}  // namespace afterglow::test
