/// \file
/// The robot's joints by its description, the one that was recorded with a behavior or today's, and
/// who tells where they are.
#pragma once

#include <string>
#include <vector>

#include "replay/motion/robot_joints.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/plan/robot_profile.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// By a URDF. Of no joint if the text is none.
replay::RobotJoints readRobotJoints(const std::string& urdf, const replay::RobotProfile& robot);

/// By the description that was recorded with the behavior; of no joint without one. Throws
/// StoreError.
replay::RobotJoints recordedJoints(const replay::Store& store, const replay::Behavior& behavior,
                                   const replay::RobotProfile& robot);
/// By /robot_description on the parameter server now; of no joint without one.
replay::RobotJoints liveDescription(const replay::RobotProfile& robot);

/// Where today's robot tells of its joints: where the recorded one did, on topics .../joint_states,
/// renamed as all its topics are; without any /joint_states. Throws StoreError.
std::vector<std::string> jointTopics(const replay::Store& store, const replay::Behavior& behavior,
                                     const replay::PlanOptions& names);

}  // namespace afterglow::nodes
