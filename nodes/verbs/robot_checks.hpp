/// \file
/// `afterglow doctor`: whether what a robot's profile names is there on the running robot.
#pragma once

#include <string>
#include <vector>

#include "nodes/verbs/checkup.hpp"
#include "nodes/verbs/robot_ear.hpp"

namespace afterglow::nodes {

/// A check for each thing that the profile names; without a name, those alone that need no profile.
/// Each bridge to ROS 2 that was heard is a check, too.
/// `running` without value: there is no master, and each check says so. Pure.
std::vector<Checkup> checkRobot(const replay::RobotProfile& robot,
                                const std::optional<RunningRobot>& running);

/// The guard's node on the robot, in its namespace.
constexpr const char* kGuardNode = "/afterglow_guard";

}  // namespace afterglow::nodes
