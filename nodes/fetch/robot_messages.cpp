#include "nodes/fetch/robot_messages.hpp"

#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

std::vector<JointTolerance> toTolerances(
    const std::vector<control_msgs::JointTolerance>& messages) {
  std::vector<JointTolerance> tolerances;
  for (const auto& message : messages) tolerances.push_back({message.name, message.position});
  return tolerances;
}

}  // namespace

Nanoseconds toNanoseconds(const ros::Time& time) {
  return Nanoseconds(static_cast<std::int64_t>(time.toNSec()));
}
Nanoseconds toNanoseconds(const ros::Duration& duration) { return Nanoseconds(duration.toNSec()); }

ros::Time toRosTime(Nanoseconds time) {
  ros::Time result;
  result.fromNSec(static_cast<std::uint64_t>(time.count()));
  return result;
}

TrajectoryGoal toGoal(const trajectory_msgs::JointTrajectory& message) {
  TrajectoryGoal goal;
  goal.stamp = toNanoseconds(message.header.stamp);
  goal.joints = message.joint_names;
  for (const auto& point : message.points)
    goal.points.push_back({point.positions, point.velocities, point.accelerations,
                           toNanoseconds(point.time_from_start)});
  return goal;
}

TrajectoryGoal toGoal(const control_msgs::FollowJointTrajectoryGoal& message) {
  TrajectoryGoal goal = toGoal(message.trajectory);
  goal.path_tolerance = toTolerances(message.path_tolerance);
  goal.goal_tolerance = toTolerances(message.goal_tolerance);
  goal.goal_time_tolerance = toNanoseconds(message.goal_time_tolerance);
  return goal;
}

geometry_msgs::TransformStamped stamped(const std::string& parent, const std::string& child,
                                        const Eigen::Isometry3d& T_parent_child,
                                        const ros::Time& stamp) {
  geometry_msgs::TransformStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = parent;
  message.child_frame_id = child;
  message.transform = toTransform(T_parent_child);
  return message;
}

geometry_msgs::Pose poseMessage(const replay::PlanarPose& pose) {
  const geometry_msgs::Transform transform = toTransform(toIsometry(pose));
  geometry_msgs::Pose message;
  message.position.x = transform.translation.x;
  message.position.y = transform.translation.y;
  message.orientation = transform.rotation;
  return message;
}

}  // namespace afterglow::nodes
