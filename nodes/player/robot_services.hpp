/// \file
/// The services of the robot that a replay asks before it moves.
///
/// The controllers that run, by ros_control's controller managers: a stopped one rejects every
/// goal, and does not hear its commands.
///
/// Asks MoveIt whether the robot may be in a pose: the service check_state_validity of its node
/// move_group, which knows the robot's shape and what it was told of the room. moveit_msgs is not
/// in Debian, so its message is declared here as far as it is used. Source: GetStateValidity.srv of
/// moveit/moveit_msgs, whose fields, like those of its RobotState and Constraints, are the same
/// from 0.5.2 to 0.11.4, to Noetic; only what lies in the lists, which are sent empty, has changed,
/// and with it the MD5, which is not compared therefore.
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/MultiDOFJointState.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "nodes/tools/next_fields.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::nodes {

/// "running", "stopped", "initialized" ... by a controller's full name: "/arm_controller".
using ControllerStates = std::map<std::string, std::string>;

/// Asks every controller manager of the graph that lives; empty on a robot without any.
ControllerStates askControllers(const RosGraph& graph);

/// Returns why nobody obeys what is sent on a topic or to an action: "arm_controller is stopped
/// (controller_manager): start it with ..."; empty if its controller runs, or is none of these.
std::string whyNotRunning(const ControllerStates& states, const std::string& topic);

struct StateValidityRequest {
  using Empty = std::vector<std::uint8_t>;

  sensor_msgs::JointState joint_state;
  sensor_msgs::MultiDOFJointState multi_dof_joint_state;
  Empty attached_collision_objects;
  std::uint8_t is_diff = 1;  ///< flag: joints that are not named are as they are now
  std::string group_name;    ///< empty: all of the robot counts
  std::string constraints_name;
  Empty joint_constraints, position_constraints, orientation_constraints, visibility_constraints;
};
struct StateValidityResponse {
  std::uint8_t valid = 0;  ///< contacts and costs follow
};

/// Asks MoveIt in one thread. A call takes as long as MoveIt does.
class StateValidity {
 public:
  /// Asks about the robot with these names.
  explicit StateValidity(const replay::RobotNames& robot);

  /// Returns true if the service is there.
  bool isThere() const;
  /// Returns why these joints may not be there, the others as they are now; empty: they may.
  std::string whyNot(const std::vector<std::string>& joints, const std::vector<double>& positions);

 private:
  std::string name_;
  ros::ServiceClient client_;
};

}  // namespace afterglow::nodes

namespace ros::serialization {

AFTERGLOW_SERIALIZED(afterglow::nodes::StateValidityRequest, message.joint_state,
                     message.multi_dof_joint_state, message.attached_collision_objects,
                     message.is_diff, message.group_name, message.constraints_name,
                     message.joint_constraints, message.position_constraints,
                     message.orientation_constraints, message.visibility_constraints)
AFTERGLOW_SERIALIZED(afterglow::nodes::StateValidityResponse, message.valid)

}  // namespace ros::serialization
