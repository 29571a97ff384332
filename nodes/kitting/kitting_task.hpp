/// \file
/// The paper's kitting task in three behaviors: pick an object that was taken for another, drive
/// round an obstacle, place into a section that was taken for another.
#pragma once

#include <functional>
#include <string>

#include "nodes/kitting/kitting_plan.hpp"
#include "nodes/kitting/kitting_robot.hpp"
#include "nodes/kitting/kitting_room.hpp"

namespace afterglow::nodes {

/// Runs in real time in the caller's thread; every behavior throws TaskError when the robot cannot
/// do it. Robot and room must outlive the task.
class KittingTask {
 public:
  /// Told of the moments worth a picture ("perceive", "reach above", ...) as they happen.
  using OnMoment = std::function<void(const std::string& moment)>;

  KittingTask(const KittingPlan& plan, KittingRobot& robot, KittingRoom& room, OnMoment on_moment);

  /// Brings arm, head and projector to where every behavior starts; part of none.
  void prepare();
  void pick();
  void drive();
  void place();

 private:
  Eigen::Vector3d inBase(const Eigen::Vector3d& p_map) const;
  /// Looks and points the projector at a point of the map, and waits for both.
  void attend(const Eigen::Vector3d& p_map, double seconds);
  sensor_msgs::PointCloud2 perceive(const std::vector<std::string>& names) const;
  Eigen::Isometry3d carryPose() const;
  /// A straight way of the gripper between two poses of equal orientation.
  void moveStraight(const Eigen::Isometry3d& T_map_from, const Eigen::Isometry3d& T_map_to,
                    double torso, double seconds);
  void moveArm(const Eigen::Isometry3d& T_map_gripper, double torso, double seconds);
  void say(const std::string& text);
  void waitUntilSaid() const;

  void grasp(const Eigen::Isometry3d& T_map_grasp);
  void release(const Eigen::Isometry3d& T_map_section);

  const KittingPlan& plan_;
  KittingRobot& robot_;
  KittingRoom& room_;
  OnMoment on_moment_;
  ros::Time said_;
};

}  // namespace afterglow::nodes
