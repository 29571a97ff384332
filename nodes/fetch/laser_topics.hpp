/// \file
/// A simulated robot's laser on the ROS graph, and for those who set the scene
/// /obstacles (geometry_msgs/PoseArray in map, position.z the radius).
#pragma once

#include <geometry_msgs/PoseArray.h>
#include <ros/ros.h>

#include <Eigen/Geometry>
#include <string>

#include "nodes/fetch/fake_laser.hpp"

namespace afterglow::nodes {

/// A scan topic; by default a Fetch's.
struct ScanTopic {
  std::string topic = "/base_scan", frame = "laser_link";
  double view = FakeLaser::kFetchView;  ///< rad to either side
};

/// The laser's topics, for one thread at a time, the callbacks of its node handle included.
class LaserTopics {
 public:
  /// `T_base_laser`: where it sits.
  LaserTopics(const PlanarPose& start, const Eigen::Isometry3d& T_base_laser,
              const ScanTopic& scan = {});

  /// Publishes fifteen times a second; called often.
  void publishIfDue(const ros::Time& now, const PlanarPose& T_map_base);
  void setThings(const geometry_msgs::PoseArray& obstacles);

 private:
  const std::string frame_;
  FakeLaser laser_;
  const PlanarPose T_base_laser_;
  const bool is_upside_down_;
  ros::Time next_;
  ros::NodeHandle node_;
  ros::Publisher publisher_;
};

}  // namespace afterglow::nodes
