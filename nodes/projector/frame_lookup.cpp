#include "nodes/projector/frame_lookup.hpp"

#include <tf2/exceptions.h>

#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {

FrameLookup::FrameLookup(const tf2::BufferCore& buffer, std::string fixed_frame)
    : buffer_(buffer), fixed_frame_(std::move(fixed_frame)) {}

std::optional<Eigen::Isometry3d> FrameLookup::at(const std::string& frame, ros::Time stamp) {
  const auto [entry, is_new] = known_.try_emplace({frame, stamp});
  if (is_new) {
    entry->second = look(frame, stamp);
    if (stamp.isZero() && entry->second && isStale(*entry->second)) entry->second.reset();
  }
  if (!entry->second) return std::nullopt;
  return entry->second->T_fixed_frame;
}

std::optional<StampedPose> FrameLookup::newest(const std::string& frame) {
  return look(frame, ros::Time(0));
}

bool FrameLookup::isStale(const StampedPose& pose) const {
  return now_ns_ > 0 && pose.stamp_ns != 0 && now_ns_ - pose.stamp_ns > kStalePoseNs;
}

std::string FrameLookup::noTransform(const std::string& what, const std::string& frame) {
  const auto pose = newest(frame);
  const std::string between = "from '" + frame + "' to '" + fixed_frame_ + "'";
  return pose && isStale(*pose) ? what + ": the transform " + between + " is stale"
                                : what + ": no transform " + between;
}

void FrameLookup::forget(std::int64_t now_ns) {
  known_.clear();
  now_ns_ = now_ns;
}

std::optional<StampedPose> FrameLookup::look(const std::string& frame, ros::Time stamp) const {
  // The fixed frame is where it is, even while tf has not heard of it.
  if (frame == fixed_frame_) return StampedPose{Eigen::Isometry3d::Identity(), 0};
  try {
    if (!buffer_.canTransform(fixed_frame_, frame, stamp)) return std::nullopt;
    const auto found = buffer_.lookupTransform(fixed_frame_, frame, stamp);
    const geometry_msgs::Vector3& t = found.transform.translation;
    if (!toVector(t.x, t.y, t.z)) return std::nullopt;  // a chain may go farther than its links
    return StampedPose{toIsometry(found.transform),
                       static_cast<std::int64_t>(found.header.stamp.toNSec())};
  } catch (const tf2::TransformException&) {
    return std::nullopt;  // frame names that tf2 refuses, loops, times beyond its cache
  }
}

}  // namespace afterglow::nodes
