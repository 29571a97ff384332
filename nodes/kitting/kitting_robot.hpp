/// \file
/// The demo's hands: a Fetch (simulated or real) through its usual action servers and topics, and
/// what it projects and says. Poses are asked of tf. Metres, radians, seconds.
#pragma once

#include <actionlib/client/simple_action_client.h>
#include <control_msgs/FollowJointTrajectoryAction.h>
#include <control_msgs/GripperCommandAction.h>
#include <control_msgs/PointHeadAction.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "nodes/fetch/robot_model.hpp"
#include "nodes/kitting/kitting_messages.hpp"

namespace afterglow::nodes {

/// The robot could not do what the task asked of it; the text says what, in one line.
class TaskError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Sleeps in ROS time; not at all if `seconds` is not positive. Throws TaskError if ROS ends.
void sleepFor(double seconds);

/// Every method may throw TaskError. Needs a running spinner.
class KittingRobot {
 public:
  KittingRobot(const RobotModel& model, const calib::Lens& projector);

  /// Returns when tf, joint states, all controllers, a projector and a speaker are there.
  void waitUntilReady(double seconds);

  // ------------------------------------------------------------------------------- where it is
  JointPositions joints() const;
  Eigen::Isometry3d T_map_base() const { return T_map_link("base_link"); }
  Eigen::Isometry3d T_map_link(const std::string& link) const;
  PlanarPose floorPose() const;

  // ------------------------------------------------------------------------------- its motions
  /// Gripper pointing down, its fingers' closing direction at `yaw` about the vertical of `map`.
  static Eigen::Isometry3d gripperDown(const Eigen::Vector3d& p_map, double yaw);
  /// Goes through these poses of the gripper at even times, the torso at a height throughout.
  /// Returns at once; finishArm() waits for it.
  void startArm(const std::vector<Eigen::Isometry3d>& T_map_gripper, double torso, double seconds);
  /// Goes there without sweeping low over what is in front: raises the folded arm at the robot's
  /// side first. Returns at once.
  void unfoldArm(const Eigen::Isometry3d& T_map_gripper, double torso, double seconds);
  void finishArm();
  void moveTorso(double height, double seconds);
  /// Returns at once.
  void startHead(double pan, double tilt, double seconds);
  void finishHead(double seconds);
  /// Turns the head's camera to a point of base_link; returns at once.
  void lookAt(const Eigen::Vector3d& p_base, double seconds);
  void setGripper(double gap, double timeout);
  /// Throws the middle of the projector's picture on a point of base_link, no further to the side
  /// than `widest`; returns at once.
  void aimProjector(const Eigen::Vector3d& p_base, double seconds, double widest = M_PI);
  void waitForHeadAndProjector(double seconds);
  void drive(const PlanarVelocity& command);
  void stop() { drive({}); }

  // ------------------------------------------------------------------ what it shows and says
  void projectClusters(const sensor_msgs::PointCloud2& white,
                       const sensor_msgs::PointCloud2& green);
  void projectSection(const visualization_msgs::Marker& marker);
  void projectPath(const visualization_msgs::MarkerArray& path);
  void projectScan(const sensor_msgs::LaserScan& scan);
  void say(const std::string& text, const std::string& voice);

 private:
  using Trajectory = control_msgs::FollowJointTrajectoryAction;
  using TrajectoryClient = actionlib::SimpleActionClient<Trajectory>;
  using PointHeadClient = actionlib::SimpleActionClient<control_msgs::PointHeadAction>;
  using GripperClient = actionlib::SimpleActionClient<control_msgs::GripperCommandAction>;

  void onJointState(const sensor_msgs::JointState& state);
  void sendArm(const std::vector<JointPositions>& points, double seconds);
  JointPositions reach(const Eigen::Isometry3d& T_map_gripper, const JointPositions& seed) const;

  RobotModel model_;
  calib::Lens projector_;
  ros::NodeHandle node_;
  tf2_ros::Buffer tf_;
  tf2_ros::TransformListener tf_listener_;
  mutable std::mutex mutex_;
  JointPositions joints_;
  ros::Subscriber joint_states_;
  TrajectoryClient arm_, torso_, head_, turret_;
  PointHeadClient point_head_;
  GripperClient gripper_;
  double arm_seconds_ = 0;
  ros::Publisher wheels_, white_, green_, section_, path_, scan_, speech_;
};

}  // namespace afterglow::nodes
