/// \file
/// A simulated Fetch on the ROS graph, as the real one looks from outside: action servers, cmd_vel,
/// joint states and odometry in its node's namespace, and tf. For judges, as no robot knows or
/// tells it:
/// - ~true_pose (geometry_msgs/PoseStamped in map): where it truly is;
/// - ~commands (sensor_msgs/JointState): what its controllers command now, a joint that is limp is
///   missing; as velocity the fastest change of a command since the message before, by cycles of
///   10 ms: a step of 0.8 rad reads 80 rad/s.
/// Its base is driven through a multiplexer, and it has a runstop (fake_switches.hpp).
/// ~hand (sensor_msgs/JointState) is somebody who switches the controllers of these joints off and
/// moves them there; ~reset somebody who puts all back to the start, and restarts the robot; ~mute
/// (std_msgs/Bool) a driver that tells of no joints any more.
/// /obstacles (geometry_msgs/PoseArray in map, position.z the radius) says what stands in its room.
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <control_msgs/FollowJointTrajectoryAction.h>
#include <control_msgs/GripperCommandAction.h>
#include <control_msgs/PointHeadAction.h>
#include <geometry_msgs/Twist.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Bool.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "nodes/fetch/fake_fetch.hpp"
#include "nodes/fetch/fake_laser.hpp"
#include "nodes/fetch/fake_switches.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::nodes {

/// The robot comes from the parameter robot_description of its namespace, the prefix of its frames
/// from tf_prefix there, the start pose in map from ~x, ~y, ~yaw,
/// how wrong the base drives from ~linear_scale, ~angular_scale, ~slip, ~latency (s) and ~seed, how
/// wrong it thinks it stands from ~localization_error (m) and ~localization_yaw_error (rad), how
/// far it goes before it knows better from ~localization_distance (m) and ~localization_turn (rad;
/// both 0: it looks all the time), how much longer joint trajectories take than they should from
/// ~slowness.
/// Throws std::runtime_error naming the parameter that is missing or wrong.
RobotModel readRobotDescription(const ros::NodeHandle& node);
FakeFetchConfig readFakeFetchConfig(const ros::NodeHandle& private_node);

/// Steps the robot with ROS time at 100 Hz and publishes at 50 Hz. Needs a spinner of its own.
/// ~scan: false takes its laser away.
class FakeFetchNode {
 public:
  FakeFetchNode(RobotModel model, const FakeFetchConfig& config);
  ~FakeFetchNode();
  FakeFetchNode(const FakeFetchNode&) = delete;
  FakeFetchNode& operator=(const FakeFetchNode&) = delete;

 private:
  using TrajectoryServer = actionlib::SimpleActionServer<control_msgs::FollowJointTrajectoryAction>;
  using PointHeadServer = actionlib::SimpleActionServer<control_msgs::PointHeadAction>;
  using GripperServer = actionlib::SimpleActionServer<control_msgs::GripperCommandAction>;

  void addTrajectoryServer(const std::string& controller);
  /// Until a controller's goal has ended; one that is canceled is still running.
  TrajectoryStatus waitForEnd(const std::string& controller,
                              const std::function<bool()>& is_canceled,
                              const std::function<void()>& each_time);
  void follow(TrajectoryServer& server, const std::string& controller,
              const control_msgs::FollowJointTrajectoryGoal& goal);
  void pointHead(const control_msgs::PointHeadGoal& goal);
  bool startPointing(const control_msgs::PointHeadGoal& goal, std::string* problem);
  void moveGripper(const control_msgs::GripperCommandGoal& goal);
  /// Returns the answer of `ask` about the robot, with the lock held.
  template <typename Ask>
  auto locked(const Ask& ask) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return ask(robot_);
  }

  bool isOpen() const;  ///< goals go on

  void onTwist(const geometry_msgs::Twist& twist);
  void onHand(const sensor_msgs::JointState& message);
  void onObstacles(const geometry_msgs::PoseArray& obstacles);
  bool onReset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response);
  void onTimer();
  void publish();
  void publishTransforms(const ros::Time& stamp);
  void publishJoints(const ros::Time& stamp);
  void publishCommands(const ros::Time& stamp);
  void publishOdometry(const ros::Time& stamp);
  void publishFixedLinks();
  void publishTruth(const ros::Time& stamp);

  /// Guards robot_; never held while calling actionlib, which has its own locks.
  std::mutex mutex_;
  const replay::RobotNames names_;
  FakeFetch robot_;
  std::unique_ptr<LaserTopics> laser_;  ///< if it has one
  ros::Time published_;
  std::atomic<bool> is_closing_{false}, is_mute_{false};

  ros::NodeHandle node_, private_node_{"~"};
  ros::Publisher joints_publisher_, odometry_publisher_, truth_publisher_, commands_publisher_;
  tf2_ros::TransformBroadcaster tf_broadcaster_;
  tf2_ros::StaticTransformBroadcaster static_tf_broadcaster_;
  tf2_ros::Buffer tf_;
  tf2_ros::TransformListener tf_listener_;
  VelocityMux mux_;
  Runstop runstop_;
  ros::Subscriber twist_subscriber_, hand_subscriber_, mute_subscriber_, obstacles_subscriber_;
  ros::ServiceServer reset_service_;
  std::vector<std::unique_ptr<TrajectoryServer>> trajectory_servers_;
  PointHeadServer point_head_server_;
  GripperServer gripper_server_;
  ros::WallTimer timer_;
};

}  // namespace afterglow::nodes
