/// \file
/// FollowJointTrajectory's messages as the simulated controllers' values.
#pragma once

#include <control_msgs/FollowJointTrajectoryFeedback.h>
#include <control_msgs/FollowJointTrajectoryGoal.h>
#include <control_msgs/FollowJointTrajectoryResult.h>
#include <ros/duration.h>
#include <ros/time.h>

#include "nodes/fetch/trajectory_follower.hpp"

namespace afterglow::nodes {

Nanoseconds toNanoseconds(const ros::Time& time);
Nanoseconds toNanoseconds(const ros::Duration& duration);
ros::Time toRosTime(Nanoseconds time);

TrajectoryGoal toGoal(const control_msgs::FollowJointTrajectoryGoal& message);
control_msgs::FollowJointTrajectoryResult toResult(const TrajectoryStatus& status);
/// Where the controller wants its joints, where they are, and the difference.
control_msgs::FollowJointTrajectoryFeedback toFeedback(const JointController& controller,
                                                       const JointStates& actual, Nanoseconds now);

}  // namespace afterglow::nodes
