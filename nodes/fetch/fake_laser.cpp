#include "nodes/fetch/fake_laser.hpp"

#include <sensor_msgs/LaserScan.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kHalfRoom = 6, kLeastWay = 4;  // m

/// Along one axis, from inside the room; far away for a beam along the wall.
double wallDistance(double from, double toward, double half_room) {
  if (std::abs(toward) < 1e-9) return 1e9;
  return (std::copysign(half_room, toward) - from) / toward;
}

}  // namespace

FakeLaser::FakeLaser(const PlanarPose& start, double view, double noise, std::uint32_t seed)
    : half_room_(std::max({kHalfRoom, std::abs(start.x) + kLeastWay,
                           std::abs(start.y) + kLeastWay})),
      noise_(noise),
      view_(view),
      random_(seed) {}

double FakeLaser::rangeOf(const PlanarPose& T_map_laser, double heading) const {
  const double cx = std::cos(heading), cy = std::sin(heading);
  double range = std::min(wallDistance(T_map_laser.x, cx, half_room_),
                          wallDistance(T_map_laser.y, cy, half_room_));
  for (const RoundThing& thing : things_) {
    const double x = thing.x - T_map_laser.x, y = thing.y - T_map_laser.y;
    const double along = x * cx + y * cy;
    const double beside2 = x * x + y * y - along * along;
    const double inside2 = thing.radius * thing.radius - beside2;
    if (along > 0 && inside2 > 0) range = std::min(range, along - std::sqrt(inside2));
  }
  return range;
}

std::vector<float> FakeLaser::look(const PlanarPose& T_map_laser, bool is_upside_down) {
  std::vector<float> ranges;
  ranges.reserve(kBeams);
  for (std::size_t beam = 0; beam < kBeams; ++beam) {
    const double angle = (firstAngle() + static_cast<double>(beam) * angleStep()) *
                         (is_upside_down ? -1 : 1);
    // Three uniform numbers of deviation 1 / sqrt(12) each make a bell that is good enough.
    double bell = -1.5;
    for (int i = 0; i < 3; ++i) bell += static_cast<double>(random_()) / 4294967296.0;
    ranges.push_back(
        static_cast<float>(rangeOf(T_map_laser, T_map_laser.yaw + angle) + 2 * noise_ * bell));
  }
  return ranges;
}

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
