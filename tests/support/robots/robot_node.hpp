/// \file
/// A robot beside the Fetch on the ROS graph, simulated, as it looks from outside: action servers
/// and commands of its controllers, its base, laser, joint states, tf, stop (robot_facts.hpp). For
/// those who test and judge:
/// - ~true_pose (geometry_msgs/PoseStamped in map): where its base truly is;
/// - ~commands (sensor_msgs/JointState): what its controllers command; as velocity the fastest
///   change of a command in a cycle of 10 ms since the message before;
/// - ~press (std_msgs/Bool): presses its stop, or releases it;
/// - ~switch_off (std_msgs/String): stops this controller, as its controller manager tells until ~reset;
/// - ~hinder (std_msgs/String): somebody holds this joint; empty: none;
/// - ~speed_scale (std_msgs/Float64): the pendant's slider; 0 is its pause;
/// - ~reset (std_srvs/Trigger): puts all back to the start.
#pragma once

#include <actionlib/server/action_server.h>
#include <control_msgs/FollowJointTrajectoryAction.h>
#include <control_msgs/GripperCommandAction.h>
#include <controller_manager_msgs/ListControllers.h>
#include <geometry_msgs/Twist.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>
#include <topic_tools/shape_shifter.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/fetch/fake_laser.hpp"
#include "tests/support/robots/robot_facts.hpp"
#include "tests/support/robots/trajectory_controller.hpp"
#include "tests/support/simulated_drive.hpp"

namespace afterglow::test {

/// A controller and who asks it to move: goals of an action, and a topic.
class ControllerTopics {
 public:
  ControllerTopics(const ControllerFacts& facts, const nodes::RobotModel& model,
                   const nodes::JointStates& joints);

  /// A cycle, after which it commands desired() of its controller.
  void step(double scale);
  /// It does not run: goals are refused, what it followed is over.
  void stop();
  void start();
  bool isRunning() const { return is_running_; }
  const std::string& name() const { return name_; }
  const TrajectoryController& controller() const { return controller_; }

 private:
  using Server = actionlib::ActionServer<control_msgs::FollowJointTrajectoryAction>;
  void onGoal(Server::GoalHandle goal);
  void onCancel(Server::GoalHandle goal);
  void onCommand(const trajectory_msgs::JointTrajectory& command);
  void preempt();

  const std::string name_;
  TrajectoryController controller_;
  const nodes::JointStates& joints_;  ///< as they are measured
  bool is_running_ = true;
  std::optional<Server::GoalHandle> goal_;
  ros::NodeHandle node_;
  ros::Subscriber command_;
  std::unique_ptr<Server> server_;
};

/// PR2's Pr2GripperCommand, which differs from control_msgs' GripperCommand in name alone.
class LimpGripper {
 public:
  LimpGripper(const GripperFacts& facts, nodes::JointState& joint);
  void step();
  void reset();

 private:
  using Server = actionlib::ActionServer<control_msgs::GripperCommandAction>;
  void onGoal(Server::GoalHandle goal);

  const GripperFacts facts_;
  nodes::JointState& joint_;
  std::optional<double> wanted_;  ///< m; empty: it is limp
  std::optional<Server::GoalHandle> goal_;
  ros::NodeHandle node_;
  std::unique_ptr<Server> server_;
};

/// An emergency stop that can be pressed, told on its topic.
class StopTopic {
 public:
  explicit StopTopic(const StopFacts& facts);
  void press(bool is_pressed);
  bool isPressed() const { return is_pressed_; }
  const StopFacts& facts() const { return facts_; }

 private:
  void publish();

  const StopFacts facts_;
  bool is_pressed_ = false;
  topic_tools::ShapeShifter message_;
  ros::NodeHandle node_;
  ros::Publisher publisher_;
  ros::WallTimer timer_;
};

/// For one thread, which spins.
class RobotNode {
 public:
  explicit RobotNode(const RobotFacts& facts);

 private:
  void onTwist(const geometry_msgs::Twist& twist);
  void onPress(bool is_pressed);
  bool reset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response);
  bool listControllers(controller_manager_msgs::ListControllers::Request&,
                       controller_manager_msgs::ListControllers::Response& response);
  void putBack();
  void onTimer();
  void step();
  void noteCommands(const TrajectoryController& controller, const std::vector<double>& before);
  void moveJoints(const TrajectoryController& controller, bool is_driven);
  void publish();
  void publishJoints();
  void publishBase();
  double seconds() const { return nodes::seconds(now_ - start_); }

  ros::NodeHandle node_, private_node_{"~"};
  const RobotFacts facts_;
  const nodes::RobotModel model_;
  nodes::JointStates joints_;
  sensor_msgs::JointState commands_;  ///< since they were published
  std::string hindered_;
  double speed_scale_ = 1;
  std::optional<SimulatedDrive> drive_;
  std::optional<SimulatedLocalization> localization_;
  nodes::Nanoseconds start_, now_, published_{0};

  std::vector<std::unique_ptr<ControllerTopics>> controllers_;
  std::optional<LimpGripper> gripper_;
  std::optional<StopTopic> stop_;
  std::optional<nodes::LaserTopics> laser_;
  tf2_ros::TransformBroadcaster tf_;
  tf2_ros::StaticTransformBroadcaster static_tf_;
  ros::Publisher joints_publisher_, commands_publisher_, odometry_publisher_, truth_publisher_,
      echo_publisher_, scale_publisher_;
  std::vector<ros::Subscriber> subscribers_;
  ros::ServiceServer reset_service_, manager_service_;
  ros::WallTimer timer_;
};

}  // namespace afterglow::test
