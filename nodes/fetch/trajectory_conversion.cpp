#include "nodes/fetch/trajectory_conversion.hpp"

namespace afterglow::nodes {
namespace {

std::vector<JointTolerance> toTolerances(
    const std::vector<control_msgs::JointTolerance>& messages) {
  std::vector<JointTolerance> tolerances;
  for (const auto& message : messages) tolerances.push_back({message.name, message.position});
  return tolerances;
}

void append(trajectory_msgs::JointTrajectoryPoint& point, double position, double velocity) {
  point.positions.push_back(position);
  point.velocities.push_back(velocity);
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

TrajectoryGoal toGoal(const control_msgs::FollowJointTrajectoryGoal& message) {
  TrajectoryGoal goal;
  goal.stamp = toNanoseconds(message.trajectory.header.stamp);
  goal.joints = message.trajectory.joint_names;
  for (const auto& point : message.trajectory.points)
    goal.points.push_back({point.positions, point.velocities, point.accelerations,
                           toNanoseconds(point.time_from_start)});
  goal.path_tolerance = toTolerances(message.path_tolerance);
  goal.goal_tolerance = toTolerances(message.goal_tolerance);
  goal.goal_time_tolerance = toNanoseconds(message.goal_time_tolerance);
  return goal;
}

control_msgs::FollowJointTrajectoryResult toResult(const TrajectoryStatus& status) {
  control_msgs::FollowJointTrajectoryResult result;
  result.error_code = static_cast<std::int32_t>(status.error);
  result.error_string = status.text;
  return result;
}

control_msgs::FollowJointTrajectoryFeedback toFeedback(const JointController& controller,
                                                       const JointStates& actual, Nanoseconds now) {
  control_msgs::FollowJointTrajectoryFeedback feedback;
  feedback.header.stamp = toRosTime(now);
  const JointStates desired = controller.desired();
  for (const Joint& joint : controller.joints()) {
    const auto wanted = desired.find(joint.name);
    const JointState is = actual.at(joint.name);
    const JointState should = wanted != desired.end() ? wanted->second : is;
    feedback.joint_names.push_back(joint.name);
    append(feedback.desired, should.position, should.velocity);
    append(feedback.actual, is.position, is.velocity);
    append(feedback.error, should.position - is.position, should.velocity - is.velocity);
  }
  return feedback;
}

}  // namespace afterglow::nodes
