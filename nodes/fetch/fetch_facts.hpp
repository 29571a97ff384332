/// \file
/// The facts that everybody who moves the Fetch of assets/fetch.urdf has to know: its controllers'
/// joints, its turrets, and how its arm is tucked. Source: fetch_description and the robot's
/// default controllers.
#pragma once

#include <string>
#include <vector>

#include "nodes/fetch/robot_model.hpp"

namespace afterglow::nodes {

constexpr const char* kGripperLink = "gripper_link";  ///< pads' middle; x along the fingers

/// Torso and arm, in the order of arm_with_torso_controller.
extern const std::vector<std::string> kArmWithTorsoJoints;
extern const std::vector<std::string> kArmJoints;  ///< the same without the torso
extern const std::vector<std::string> kHeadJoints;
extern const std::vector<std::string> kProjectorJoints;
extern const std::vector<std::string> kGripperJoints;  ///< joints that each open by half the gap

/// Points directions given in projector_optical_frame (x right, y down, z forward).
extern const PanTilt kProjectorTurret;
/// Points directions given in head_camera_link (x forward).
extern const PanTilt kHeadTurret;

JointPositions tuckedArm();  ///< folded beside the torso, as a Fetch drives; torso down

}  // namespace afterglow::nodes
