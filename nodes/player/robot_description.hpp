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

/// Reads joints from a URDF. Of no joint if the text is none.
replay::RobotJoints readRobotJoints(const std::string& urdf, const replay::RobotProfile& robot);

/// The URDF that was recorded with the behavior; empty without one. Throws StoreError.
std::string recordedDescription(const replay::Store& store, const replay::Behavior& behavior);

/// Reads joints from the description that was recorded with the behavior; no joint without one.
/// Throws StoreError.
replay::RobotJoints recordedJoints(const replay::Store& store, const replay::Behavior& behavior,
                                   const replay::RobotProfile& robot);
/// Reads joints from robot_description on the parameter server now, as the robot in that namespace
/// has it; no joint without one.
replay::RobotJoints liveDescription(const std::string& name_space,
                                    const replay::RobotProfile& robot);

/// The recorded topics of a type that are called like one of the robot's: "/joint_states" and
/// "/fetch7/joint_states", but for those outside of its namespace; if there is none, `usual` as the
/// robot has it. Throws StoreError.
std::vector<std::string> recordedTopics(const replay::Store& store,
                                        const replay::Behavior& behavior,
                                        const std::vector<std::string>& types,
                                        const std::string& usual);
/// Returns that topic's name on today's robot: renamed as all topics of the plan are, unless the
/// plan plays it, so that it would hear itself.
std::string liveName(const replay::PlayPlan& plan, const replay::PlanOptions& names,
                     const std::string& recorded);

}  // namespace afterglow::nodes
