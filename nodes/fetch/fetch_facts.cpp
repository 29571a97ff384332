#include "nodes/fetch/fetch_facts.hpp"

namespace afterglow::nodes {

const std::vector<std::string> kArmWithTorsoJoints = {
    "torso_lift_joint", "shoulder_pan_joint", "shoulder_lift_joint", "upperarm_roll_joint",
    "elbow_flex_joint", "forearm_roll_joint", "wrist_flex_joint",    "wrist_roll_joint"};
const std::vector<std::string> kArmJoints(kArmWithTorsoJoints.begin() + 1,
                                          kArmWithTorsoJoints.end());
const std::vector<std::string> kHeadJoints = {"head_pan_joint", "head_tilt_joint"};
const std::vector<std::string> kProjectorJoints = {"projector_pan_joint", "projector_tilt_joint"};
const std::vector<std::string> kGripperJoints = {"l_gripper_finger_joint",
                                                 "r_gripper_finger_joint"};

const PanTilt kProjectorTurret = {"projector_pan_joint", "projector_tilt_joint",
                                  "projector_optical_frame"};
const PanTilt kHeadTurret = {"head_pan_joint", "head_tilt_joint", "head_camera_link"};

JointPositions tuckedArm() {
  return {{"torso_lift_joint", 0.0},     {"shoulder_pan_joint", 1.32}, {"shoulder_lift_joint", 1.4},
          {"upperarm_roll_joint", -0.2}, {"elbow_flex_joint", 1.72},   {"forearm_roll_joint", 0.0},
          {"wrist_flex_joint", 1.66},    {"wrist_roll_joint", 0.0}};
}

}  // namespace afterglow::nodes
