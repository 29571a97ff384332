#include "nodes/player/base_sensors.hpp"

#include <fmt/format.h>
#include <tf2/exceptions.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/player/ros_clock.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kPoseQueue = 100;
constexpr std::int64_t kLongestQueued = 100'000'000;

/// Seen from above; empty if it is none.
std::optional<replay::PlanarPose> planarPose(const geometry_msgs::Transform& transform) {
  const auto& q = transform.rotation;
  const replay::PlanarPose pose{transform.translation.x, transform.translation.y,
                                replay::headingOf(q.x, q.y, q.z, q.w)};
  const bool is_finite = std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.yaw);
  return is_finite ? std::optional(pose) : std::nullopt;
}

/// Returns when a message came that has been in the queue since: by the wall clock, if that was not
/// set.
replay::Stamp receiptOf(const ros::Time& received) {
  const std::int64_t queued_ns = toStamp(ros::Time::now()).ns - toStamp(received).ns;
  return {stampNow().ns - std::clamp<std::int64_t>(queued_ns, 0, kLongestQueued)};
}

}  // namespace

replay::Stamp stampNow() { return {robotNow().ns}; }

BasePoses::BasePoses(const replay::TrackFrames& frames)
    : frames_{frameName(frames.map), frameName(frames.odometry), frameName(frames.base),
              frames.topic} {
  node_.setCallbackQueue(&queue_);
  subscriber_ = node_.subscribe<tf2_msgs::TFMessage>(
      frames_.topic, kPoseQueue,
      [this](const ros::MessageEvent<tf2_msgs::TFMessage const>& event) { onTransforms(event); },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
}

replay::BaseInput BasePoses::look(replay::Stamp now) {
  queue_.callAvailable();
  return {now, T_odom_base_, T_map_odom_};
}

replay::BaseInput BasePoses::wait(bool for_localization, double patience_s,
                                  const std::function<bool()>& is_stopped) {
  const RobotPatience patience(patience_s);
  // One alone may be a latched word of a node that is gone.
  const auto isAlive = [&] {
    const replay::BaseInput input = look(stampNow());
    return odometry_clock_.count() > 1 &&
           input.now.ns - input.T_odom_base->stamp.ns <= replay::kMotionSilence.longest;
  };
  const auto lacks = [&] { return !isAlive() || (for_localization && !T_map_odom_); };
  while (lacks() && !is_stopped() && !patience.isOver()) {
    queue_.callAvailable(ros::WallDuration(0.02));
  }
  const bool is_alive = isAlive();
  replay::BaseInput input = look(stampNow());
  if (!is_alive) input.T_odom_base.reset();
  return input;
}

void BasePoses::onTransforms(const ros::MessageEvent<tf2_msgs::TFMessage const>& event) {
  const replay::Stamp received = receiptOf(event.getReceiptTime());
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    const std::string parent = frameName(transform.header.frame_id);
    const std::string child = frameName(transform.child_frame_id);
    if (parent == frames_.odometry && child == frames_.base) {
      onOdometry(transform, received);
    } else if (parent == frames_.map && child == frames_.odometry) {
      const auto pose = planarPose(transform.transform);
      if (pose) T_map_odom_ = replay::StampedPose{received, *pose};
    }
  }
}

void BasePoses::onOdometry(const geometry_msgs::TransformStamped& transform,
                           replay::Stamp received) {
  const auto pose = planarPose(transform.transform);
  if (!pose) return;
  const auto stamp = odometry_clock_.heard(toStamp(transform.header.stamp), received);
  if (stamp) T_odom_base_ = replay::StampedPose{*stamp, *pose};
}

namespace {

constexpr double kScanPatience = 3;        // s
constexpr double kMostTilted = 0.1;        // rise of the scan's plane per meter
constexpr std::size_t kMostRanges = 100000;
/// m: what is so near to the plane of the scan may be seen in it; how thick parts are.
constexpr double kPlane = 0.15, kPartRadius = 0.12;

}  // namespace

std::set<std::string> linkNames(const std::string& urdf) {
  const urdf::ModelInterfaceSharedPtr model =
      urdf.empty() ? urdf::ModelInterfaceSharedPtr() : urdf::parseURDF(urdf);
  std::set<std::string> names;
  if (!model) return names;
  for (const auto& [name, link] : model->links_) names.insert(name);
  return names;
}

LiveScan::LiveScan(const std::string& topic, const std::string& base_frame,
                   const std::optional<replay::Footprint>& outline,
                   const replay::RobotNames& robot)
    : topic_(topic), base_frame_(frameName(base_frame)), outline_(outline), tf_listener_(tf_) {
  for (const std::string& link :
       linkNames(robotParameter(robot.name_space, "robot_description"))) {
    links_.insert(robot.frame(link));
  }
  node_.setCallbackQueue(&queue_);
  subscriber_ = node_.subscribe<sensor_msgs::LaserScan>(
      topic_, 1, [this](const sensor_msgs::LaserScan::ConstPtr& message) { onScan(*message); },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
}

std::shared_ptr<const replay::FloorScan> LiveScan::look() {
  queue_.callAvailable();
  return scan_;
}

std::string LiveScan::check(const std::function<bool()>& is_stopped) {
  const RobotPatience patience(kScanPatience);
  replay::SilenceMonitor watch(replay::kMotionSilence);
  while (!watch.knowsPeriod() && !is_stopped() && !patience.isOver()) {
    queue_.callAvailable(ros::WallDuration(0.02));
    if (scan_) watch.heard(scan_->stamp());
  }
  if (is_stopped()) return "";
  if (!scan_) return problem_.empty() ? "no scan comes on " + topic_ : topic_ + ": " + problem_;
  if (scan_->isBlind()) return "the scan on " + topic_ + " sees nothing at all";
  if (!watch.knowsPeriod()) return "scans on " + topic_ + " come too rarely to drive by them";
  const replay::Stamp now = stampNow();
  if (!watch.isOverdue(now)) return "";
  return fmt::format("the scan on {} is {:.2f} s old when it comes, or its clock is another",
                     topic_, watch.silence(now));
}

void LiveScan::onScan(const sensor_msgs::LaserScan& message) {
  const replay::Stamp wall = rosStampNow(), now = stampNow();
  if (wall_clock_.hasStepped(wall, now)) {  // the next one is dated by the new time
    delay_ns_ = 0;
    return;
  }
  const std::int64_t age_ns = wall.ns - toStamp(message.header.stamp).ns;
  delay_ns_ = std::min(delay_ns_, age_ns);
  const auto mount = mountOf(frameName(message.header.frame_id));
  if (!mount) return;
  if (message.ranges.size() > kMostRanges) {
    problem_ = "it has more ranges than any range finder";
    return;
  }
  try {
    scan_ = std::make_shared<replay::FloorScan>(
        replay::RangeScan{{now.ns - age_ns + delay_ns_}, message.angle_min,
                          message.angle_increment, message.range_min, message.range_max,
                          message.ranges},
        *mount, outline_ ? &*outline_ : nullptr, ownParts());
    problem_.clear();
  } catch (const std::invalid_argument& error) {
    problem_ = error.what();
  }
}

/// T_base_frame; throws tf2::TransformException.
Eigen::Isometry3d LiveScan::poseOf(const std::string& frame) const {
  return toIsometry(tf_.lookupTransform(base_frame_, frame, ros::Time(0)).transform);
}

std::optional<replay::ScanMount> LiveScan::mountOf(const std::string& frame) {
  try {
    const Eigen::Isometry3d T_base_scan = poseOf(frame);
    const Eigen::Matrix3d R = T_base_scan.linear();
    if (std::hypot(R(2, 0), R(2, 1)) > kMostTilted) {
      problem_ = "its plane is not level (tf's " + base_frame_ + " -> " + frame + ")";
      return {};
    }
    const Eigen::Vector3d p = T_base_scan.translation();
    height_ = p.z();
    return replay::ScanMount{{p.x(), p.y()}, {R(0, 0), R(1, 0)}, {R(0, 1), R(1, 1)}};
  } catch (const tf2::TransformException&) {
    problem_ = "nobody tells where it is on the robot (tf's " + base_frame_ + " -> " + frame + ")";
    return {};
  }
}

/// The robot's links outside of its base that cross the plane of the scan: an arm that hangs down.
std::vector<replay::OwnPart> LiveScan::ownParts() const {
  const replay::Footprint base = outline_.value_or(replay::ObstacleOptions().footprint);
  std::vector<replay::OwnPart> parts;
  for (const std::string& link : links_) {
    std::string parent;
    if (!tf_._getParent(link, ros::Time(0), parent) || links_.count(parent) == 0) continue;
    try {
      const Eigen::Vector3d from = poseOf(parent).translation(), to = poseOf(link).translation();
      const bool is_low = std::min(from.z(), to.z()) < height_ + kPlane;
      const bool is_high = std::max(from.z(), to.z()) > height_ - kPlane;
      const bool is_of_base = base.distanceTo({from.x(), from.y()}) < 0 &&
                              base.distanceTo({to.x(), to.y()}) < 0;
      if (!is_low || !is_high || is_of_base) continue;
      parts.push_back({{from.x(), from.y()}, {to.x(), to.y()}, kPartRadius});
    } catch (const tf2::TransformException&) {
      continue;  // nobody tells of it now
    }
  }
  return parts;
}

}  // namespace afterglow::nodes
