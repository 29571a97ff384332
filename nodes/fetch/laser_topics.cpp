#include "nodes/fetch/laser_topics.hpp"

#include <sensor_msgs/LaserScan.h>

#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {

LaserTopics::LaserTopics(const PlanarPose& start, const Eigen::Isometry3d& T_base_laser,
                         const ScanTopic& scan)
    : frame_(scan.frame),
      laser_(start, scan.view),
      T_base_laser_(toPlanarPose(T_base_laser)),
      is_upside_down_(T_base_laser.linear()(2, 2) < 0),
      publisher_(node_.advertise<sensor_msgs::LaserScan>(scan.topic, 5)) {}

void LaserTopics::setThings(const geometry_msgs::PoseArray& obstacles) {
  std::vector<RoundThing> things;
  for (const geometry_msgs::Pose& pose : obstacles.poses) {
    things.push_back({pose.position.x, pose.position.y, pose.position.z});
  }
  laser_.setThings(std::move(things));
}

void LaserTopics::publishIfDue(const ros::Time& now, const PlanarPose& T_map_base) {
  const ros::Duration period(FakeLaser::kPeriod);
  if (now < next_ && next_ - now <= period) return;  // a clock that was set back begins anew
  next_ = now - next_ > period ? now + period : next_ + period;
  sensor_msgs::LaserScan scan;
  scan.header.stamp = now;
  scan.header.frame_id = frame_;
  scan.angle_min = static_cast<float>(laser_.firstAngle());
  scan.angle_max = -scan.angle_min;
  scan.angle_increment = static_cast<float>(laser_.angleStep());
  scan.range_min = static_cast<float>(FakeLaser::kNearest);
  scan.range_max = static_cast<float>(FakeLaser::kFarthest);
  scan.scan_time = static_cast<float>(FakeLaser::kPeriod);
  scan.ranges = laser_.look(compose(T_map_base, T_base_laser_), is_upside_down_);
  publisher_.publish(scan);
}

}  // namespace afterglow::nodes
