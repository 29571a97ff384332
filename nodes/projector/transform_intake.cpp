#include "nodes/projector/transform_intake.hpp"

#include <cmath>
#include <cstdint>
#include <exception>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

/// Clocks of one robot differ by less.
constexpr std::int64_t kFarthestAheadNs = 60'000'000'000;
/// tf2 adds its ten seconds of memory to a stamp, and ROS times end with 32 bits of seconds.
constexpr std::int64_t kLastNs = (std::int64_t{1} << 32) * 1'000'000'000 - 2 * kFarthestAheadNs;
constexpr double kOffUnit = 0.01;  // tf2's tolerance

std::string stampFault(ros::Time stamp, ros::Time now) {
  if (stamp.nsec >= 1'000'000'000u) return "stamp is no time";
  const auto stamp_ns = static_cast<std::int64_t>(stamp.toNSec());
  const auto now_ns = static_cast<std::int64_t>(now.toNSec());
  const bool is_ahead = !now.isZero() && stamp_ns > now_ns + kFarthestAheadNs;
  return is_ahead || stamp_ns > kLastNs ? "stamp lies in the future" : "";
}

std::string placeFault(const geometry_msgs::Transform& transform) {
  const geometry_msgs::Vector3& p = transform.translation;
  const geometry_msgs::Quaternion& q = transform.rotation;
  if (!toVector(p.x, p.y, p.z)) return "not finite or absurdly far";
  const double norm = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  return std::abs(norm - 1) <= kOffUnit ? "" : "rotation is not normalized";
}

}  // namespace

std::string takeTransform(tf2::BufferCore& buffer, const geometry_msgs::TransformStamped& transform,
                          const std::string& authority, bool is_static, ros::Time now) {
  const std::string child = frameName(transform.child_frame_id);
  const std::string parent = frameName(transform.header.frame_id);
  const std::string of = "transform of '" + printable(child) + "': ";
  if (child.empty() || parent.empty()) return of + "a frame without a name";
  if (child == parent) return of + "its own parent";
  std::string fault = placeFault(transform.transform);
  if (fault.empty() && !is_static) fault = stampFault(transform.header.stamp, now);
  if (!fault.empty()) return of + fault;
  try {
    // False also for what repeats or is too old, which happens to the best.
    buffer.setTransform(transform, authority, is_static);
  } catch (const std::exception& error) {
    return of + error.what();
  }
  return {};
}

}  // namespace afterglow::nodes
