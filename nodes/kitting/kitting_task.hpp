/// \file
/// The paper's kitting task in three behaviors: pick an object that was taken for another, drive
/// round an obstacle, place into a section that was taken for another. Meters, seconds.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <functional>
#include <string>
#include <vector>

#include "nodes/kitting/kitting_robot.hpp"
#include "nodes/kitting/kitting_room.hpp"

namespace afterglow::nodes {

/// Topics of every behavior, as the paper's sample code records them.
const std::vector<std::string>& kittingTopics();

/// Runs in real time in the caller's thread; every behavior throws TaskError when the robot cannot
/// do it. Robot and room must outlive the task.
class KittingTask {
 public:
  struct Callbacks {
    /// Told of the moments worth an image ("perceive", "reach above", ...) as they happen.
    std::function<void(const std::string& moment)> on_moment;
    std::function<void()> on_room_changed;
    /// Says this behavior's sentence.
    std::function<void()> say;
  };

  KittingTask(KittingRobot& robot, KittingRoom& room, Callbacks callbacks);

  /// Brings arm, head and projector to where every behavior starts; part of none.
  void prepare();
  /// "pick", "drive" or "place"; throws TaskError for another.
  void run(const std::string& behavior);

 private:
  void pick();
  void drive();
  void place();
  Eigen::Vector3d inBase(const Eigen::Vector3d& p_map) const;
  sensor_msgs::PointCloud2 perceive(const std::vector<std::string>& names) const;
  Eigen::Isometry3d carryPose() const;
  /// A straight way of the gripper between two poses of equal orientation.
  void moveStraight(const Eigen::Isometry3d& T_map_from, const Eigen::Isometry3d& T_map_to,
                    double torso, double seconds);
  void moveArm(const Eigen::Isometry3d& T_map_gripper, double torso, double seconds);
  void say();
  void waitUntilSaid() const;
  void grasp(const Eigen::Isometry3d& T_map_grasp);
  void release(const Eigen::Isometry3d& T_map_section);

  KittingRobot& robot_;
  KittingRoom& room_;
  Callbacks callbacks_;
  ros::Time said_;
};

}  // namespace afterglow::nodes
