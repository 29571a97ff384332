/// \file
/// A base's laser, simulated, by default a Fetch's: what it sees of a room with four walls and of
/// round things that stand in it. Source of its limits: fetch_bringup's laser.launch. Frame: map;
/// meters, radians.
/// A simulated robot's laser on the ROS graph, and for those who set the scene
/// /obstacles (geometry_msgs/PoseArray in map, position.z the radius).
#pragma once

#include <geometry_msgs/PoseArray.h>
#include <ros/ros.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {

using replay::PlanarPose;

/// Something that stands in the room: a leg, a box.
struct RoundThing {
  double x = 0, y = 0, radius = 0;
};

class FakeLaser {
 public:
  static constexpr std::size_t kBeams = 661;
  static constexpr double kFetchView = 1.92;  ///< rad to either side: blind behind
  static constexpr double kNearest = 0.05, kFarthest = 25;
  static constexpr double kPeriod = 1 / 15.;  ///< s

  /// A room of 12 m by 12 m about the origin, larger where the robot stands elsewhere. `noise`:
  /// standard deviation of a range, m. `view`: rad that it looks to either side.
  explicit FakeLaser(const PlanarPose& start, double view = kFetchView, double noise = 0.01,
                     std::uint32_t seed = 3);

  double firstAngle() const { return -view_; }
  double angleStep() const { return 2 * view_ / (kBeams - 1); }

  /// Replaces the things that stand in the room.
  void setThings(std::vector<RoundThing> things) { things_ = std::move(things); }
  /// A range for each beam. A Fetch's is mounted upside down: it looks from left to right.
  std::vector<float> look(const PlanarPose& T_map_laser, bool is_upside_down);

 private:
  double rangeOf(const PlanarPose& T_map_laser, double heading) const;

  const double half_room_, noise_, view_;
  std::mt19937 random_;
  std::vector<RoundThing> things_;
};

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
