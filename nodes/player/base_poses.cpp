#include "nodes/player/base_poses.hpp"

#include <algorithm>
#include <cmath>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/player/ros_clock.hpp"

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

}  // namespace afterglow::nodes
