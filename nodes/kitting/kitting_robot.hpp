/// \file
/// The demo's hands: a Fetch (simulated or real) through its usual action servers and topics, and
/// what it projects and says. Poses are asked of tf. Meters, radians, seconds.
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <array>
#include <mutex>
#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "nodes/fetch/robot_model.hpp"
#include "nodes/kitting/demo_clients.hpp"

namespace afterglow::nodes {

/// The robot of the kitting task; every method may throw TaskError. Needs a running spinner.
class KittingRobot {
 public:
  /// The robot's light, its words, and its wheels.
  struct Outputs {
    ros::Publisher wheels, white, green, section, path, scan, speech;
  };

  KittingRobot(const RobotModel& model, const calib::Lens& projector);

  /// Returns when tf, joint states, all controllers, a projector and a speaker are there.
  void waitUntilReady(double seconds);
  /// Publishes nothing from now on, so that a player is the only one who does.
  void leaveGraph();

  // ------------------------------------------------------------------------------- where it is
  JointPositions joints() const;
  Eigen::Isometry3d T_map_base() const { return T_map_link("base_link"); }
  Eigen::Isometry3d T_map_link(const std::string& link) const;

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
  void setGripper(double gap, double timeout);
  /// Throws the middle of the projector's image on a point of base_link, no further to the side
  /// than `widest`; returns at once.
  void aimProjector(const Eigen::Vector3d& p_base, double seconds, double widest = M_PI);
  /// Looks and points the projector at a point of base_link, and waits for both.
  void attend(const Eigen::Vector3d& p_base, double seconds);

  const Outputs& out() const { return out_; }

 private:
  void onJointState(const sensor_msgs::JointState& state);
  std::string missing() const;
  void sendArm(const std::vector<JointPositions>& points, double seconds);
  JointPositions reach(const Eigen::Isometry3d& T_map_gripper, const JointPositions& seed) const;

  RobotModel model_;
  calib::Lens projector_;
  ros::NodeHandle node_;
  tf2_ros::Buffer tf_;
  tf2_ros::TransformListener tf_listener_{tf_};
  mutable std::mutex mutex_;
  JointPositions joints_;
  ros::Subscriber joint_states_;
  ActionClient arm_, torso_, head_, turret_, point_head_, gripper_;
  const std::array<ActionClient*, 6> clients_ = {&arm_,    &torso_,      &head_,
                                                 &turret_, &point_head_, &gripper_};
  double arm_seconds_ = 0;
  Outputs out_;
  const std::array<ros::Publisher*, 7> publishers_ = {&out_.wheels,  &out_.white, &out_.green,
                                                      &out_.section, &out_.path,  &out_.scan,
                                                      &out_.speech};
};

}  // namespace afterglow::nodes
