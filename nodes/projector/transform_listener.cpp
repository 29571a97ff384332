#include "nodes/projector/transform_listener.hpp"

#include <chrono>
#include <cmath>
#include <cstdint>
#include <exception>
#include <iterator>
#include <limits>
#include <optional>
#include <string>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostChildren = 10'000, kMostParents = 8;
constexpr std::int64_t kStatic = std::numeric_limits<std::int64_t>::max();

}  // namespace

void ParentMonitor::note(const std::string& child, const std::string& parent,
                         const std::string& publisher, bool is_static, std::int64_t now_ns) {
  if (links_.size() >= kMostChildren && links_.count(child) == 0) return;
  auto& parents = links_[child];
  if (parents.size() >= kMostParents && parents.count(parent) == 0) return;
  for (auto it = parents.begin(); is_static && it != parents.end();) {
    const bool is_replaced = it->second.at_ns == kStatic && it->second.publisher == publisher;
    it = is_replaced ? parents.erase(it) : std::next(it);
  }
  parents[parent] = {publisher, is_static ? kStatic : now_ns};
}

std::vector<std::string> ParentMonitor::conflicts(std::int64_t now_ns) const {
  std::vector<std::string> all;
  for (const auto& [child, parents] : links_) {
    std::string words;
    int count = 0;
    for (const auto& [parent, link] : parents) {
      if (link.at_ns < now_ns - kMemoryNs) continue;
      words += std::string(++count > 1 ? " and '" : "'") + printable(parent) + "' (published by " +
               printable(link.publisher) + ")";
    }
    if (count < 2) continue;
    all.push_back("frame '" + printable(child) + "' has " +
                  (count == 2 ? "two" : std::to_string(count)) + " parents: " + words);
  }
  return all;
}

namespace {

constexpr std::uint32_t kQueue = 100;           // tf2_ros's
constexpr std::uint64_t kJumpNs = 500'000'000;  // less is a clock being set right

/// Clocks of one robot differ by less.
constexpr std::int64_t kFutureNs = 60'000'000'000;
/// tf2 adds its ten seconds of memory to a stamp, and ROS times end with 32 bits of seconds.
constexpr std::int64_t kLastNs = (std::int64_t{1} << 32) * 1'000'000'000 - 2 * kFutureNs;
constexpr double kOffUnit = 0.01;               // tf2's tolerance
constexpr double kJump = 0.5, kJumpSpeed = 20;  // m, m/s

std::int64_t steadyNow() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

std::string stampFault(ros::Time stamp, ros::Time now) {
  if (stamp.nsec >= 1'000'000'000u) return "stamp is no time";
  const auto stamp_ns = static_cast<std::int64_t>(stamp.toNSec());
  const auto now_ns = static_cast<std::int64_t>(now.toNSec());
  const bool is_ahead = !now.isZero() && stamp_ns > now_ns + kFutureNs;
  return is_ahead || stamp_ns > kLastNs ? "stamp lies in the future" : "";
}

std::string placeFault(const geometry_msgs::Transform& transform) {
  const geometry_msgs::Vector3& p = transform.translation;
  const geometry_msgs::Quaternion& q = transform.rotation;
  if (!toVector(p.x, p.y, p.z)) return "not finite or absurdly far";
  const double norm = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  return std::abs(norm - 1) <= kOffUnit ? "" : "rotation is not normalized";
}

/// The newest that is known of the same link.
std::optional<geometry_msgs::TransformStamped> newestOf(
    const tf2::BufferCore& buffer, const geometry_msgs::TransformStamped& transform) {
  const std::string parent = frameName(transform.header.frame_id);
  const std::string child = frameName(transform.child_frame_id);
  if (!buffer.canTransform(parent, child, ros::Time(0))) return std::nullopt;
  return buffer.lookupTransform(parent, child, ros::Time(0));
}

/// Returns true if the frame has jumped from where it was: farther and faster than robots move.
bool hasJumped(const geometry_msgs::TransformStamped& from,
               const geometry_msgs::TransformStamped& to) {
  const double distance =
      (toIsometry(from.transform).translation() - toIsometry(to.transform).translation()).norm();
  const auto between_ns = static_cast<std::int64_t>(to.header.stamp.toNSec()) -
                          static_cast<std::int64_t>(from.header.stamp.toNSec());
  const double seconds = static_cast<double>(between_ns) * 1e-9;
  return distance > kJump && seconds > 0 && distance > kJumpSpeed * seconds;
}

/// Returns whether the frame has jumped. Repeated and too old transforms are no fault: tf2 ignores
/// them, too, but warns each time.
bool setTransform(tf2::BufferCore& buffer, const geometry_msgs::TransformStamped& transform,
                  const std::string& authority, bool is_static) {
  const auto before = is_static ? std::nullopt : newestOf(buffer, transform);
  if (before && !before->header.stamp.isZero()) {
    const ros::Time stamp = transform.header.stamp;
    if (stamp == before->header.stamp || stamp + buffer.getCacheLength() < before->header.stamp) {
      std::string parent;
      const bool is_same_link =
          buffer._getParent(frameName(transform.child_frame_id), ros::Time(0), parent) &&
          parent == frameName(transform.header.frame_id);
      if (is_same_link) return false;
    }
  }
  const bool has_jumped = before && hasJumped(*before, transform);
  if (has_jumped) {
    geometry_msgs::TransformStamped until = transform;
    until.transform = before->transform;
    until.header.stamp.fromNSec(transform.header.stamp.toNSec() - 1);
    buffer.setTransform(until, authority);
  }
  buffer.setTransform(transform, authority, is_static);
  return has_jumped;
}

}  // namespace

TransformListener::TransformListener(tf2::BufferCore& buffer) : buffer_(buffer) {
  status_.topic = "/tf";
  thread_.hear<Event>("/tf", kQueue, [this](const Event& event) { take(event, false); });
  thread_.hear<Event>("/tf_static", kQueue, [this](const Event& event) { take(event, true); });
  thread_.begin();
}

void TransformListener::take(const Event& event, bool is_static) {
  const ros::Time now = ros::Time::now();
  if (now.toNSec() + kJumpNs < last_time_.toNSec()) {
    ROS_WARN("ROS time has jumped back: transforms are forgotten");
    buffer_.clear();
  }
  last_time_ = now;
  const std::lock_guard<std::mutex> lock(mutex_);
  ++status_.received;
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    const auto [is_stored, reason] =
        storeTransform(buffer_, transform, event.getPublisherName(), is_static, now);
    if (!is_stored) {
      status_.drop(reason);
      continue;
    }
    if (!reason.empty()) status_.remark(reason);
    parents_.note(frameName(transform.child_frame_id), frameName(transform.header.frame_id),
                  event.getPublisherName(), is_static, steadyNow());
  }
}

LayerStatus TransformListener::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return status_;
}

std::vector<std::string> TransformListener::conflicts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return parents_.conflicts(steadyNow());
}

StoredTransform storeTransform(tf2::BufferCore& buffer,
                               const geometry_msgs::TransformStamped& transform,
                               const std::string& authority, bool is_static, ros::Time now) {
  const std::string child = frameName(transform.child_frame_id);
  const std::string parent = frameName(transform.header.frame_id);
  const std::string of = "transform of '" + printable(child) + "': ";
  if (child.empty() || parent.empty()) return {false, of + "a frame without a name"};
  if (!isFrameName(child) || !isFrameName(parent)) {
    return {false, of + "a frame's name begins with more than one '/'"};
  }
  if (child == parent) return {false, of + "its own parent"};
  std::string fault = placeFault(transform.transform);
  if (fault.empty() && !is_static) fault = stampFault(transform.header.stamp, now);
  if (!fault.empty()) return {false, of + fault};
  try {
    return {true, setTransform(buffer, transform, authority, is_static) ? of + "has jumped" : ""};
  } catch (const std::exception& error) {
    return {false, of + error.what()};
  }
}

}  // namespace afterglow::nodes
