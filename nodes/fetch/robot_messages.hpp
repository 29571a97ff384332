/// \file
/// Messages that simulated robots take and send, as values and back.
#pragma once

#include <control_msgs/FollowJointTrajectoryGoal.h>
#include <geometry_msgs/Pose.h>
#include <geometry_msgs/TransformStamped.h>
#include <ros/time.h>
#include <trajectory_msgs/JointTrajectory.h>

#include <Eigen/Geometry>
#include <string>

#include "nodes/fetch/joint_controller.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {

Nanoseconds toNanoseconds(const ros::Time& time);
Nanoseconds toNanoseconds(const ros::Duration& duration);
ros::Time toRosTime(Nanoseconds time);

/// Makes a goal without tolerances.
TrajectoryGoal toGoal(const trajectory_msgs::JointTrajectory& message);
TrajectoryGoal toGoal(const control_msgs::FollowJointTrajectoryGoal& message);

geometry_msgs::TransformStamped stamped(const std::string& parent, const std::string& child,
                                        const Eigen::Isometry3d& T_parent_child,
                                        const ros::Time& stamp);
geometry_msgs::Pose poseMessage(const replay::PlanarPose& pose);

}  // namespace afterglow::nodes
