#include "nodes/projector/frame_lookup.hpp"

#include <tf2/exceptions.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

/// Radians. The axis of a smaller turn is noise, and far away.
constexpr double kLeastTurn = 1e-6;

constexpr int kMostLinks = 100;

/// Farther ahead of the newest transform than this, velocity cannot be taken for constant.
constexpr std::int64_t kFarthestAheadNs = 500'000'000;

/// 0: static, or gone meanwhile.
std::int64_t stampOfLink(const tf2::BufferCore& buffer, const std::string& parent,
                         const std::string& child) {
  try {
    const auto link = buffer.lookupTransform(parent, child, ros::Time(0));
    return static_cast<std::int64_t>(link.header.stamp.toNSec());
  } catch (const tf2::TransformException&) {
    return 0;
  }
}

/// Returns true if two poses differ by more than tf's noise.
bool hasMoved(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() > 1e-3 ||
         Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() > 1e-3;
}

/// Returns true if two poses are farther apart than a robot carries a projector within
/// kVelocityBaseNs: it was put elsewhere then, and its velocity cannot be told.
bool hasJumped(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() > 1;
}

}  // namespace

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

std::string FrameLookup::noTransform(const std::string& subject, const std::string& frame) {
  return subject + ": " + missing(frame);
}

std::string FrameLookup::missing(const std::string& frame) {
  const auto pose = newest(frame);
  const std::string between =
      "from '" + printable(frame) + "' to '" + printable(fixed_frame_) + "'";
  return pose && isStale(*pose) ? "the transform " + between + " is stale" + oldestLink(frame)
                                : "no transform " + between;
}

std::string FrameLookup::notPlaced(const std::string& frame, ros::Time stamp,
                                   std::int64_t arrived_ns) {
  const std::int64_t skew_ns = static_cast<std::int64_t>(stamp.toNSec()) - arrived_ns;
  const bool is_skewed = !stamp.isZero() && std::abs(skew_ns) > kStalePoseNs;
  if (!is_skewed || !newest(frame)) return missing(frame);
  const std::string by = "stamped " + std::to_string(std::abs(skew_ns) / 1'000'000'000) + " s ";
  const std::string way_out = "set its sender's clock by tf's (chrony, ntp), or stamp it 0";
  return skew_ns > 0 ? by + "after it came, ahead of tf: " + way_out
                     : by + "before it came, older than what tf has (10 s at most): " + way_out;
}

std::string FrameLookup::smoothFrame(const std::string& frame) const {
  std::string parent;
  std::string child = frame;
  for (int i = 0; i < kMostLinks && child != fixed_frame_; ++i, child = parent) {
    if (child.compare(child.rfind('/') + 1, 4, "odom") == 0) return child;
    if (!buffer_._getParent(child, ros::Time(0), parent)) break;
  }
  return fixed_frame_;
}

std::optional<Eigen::Isometry3d> FrameLookup::predicted(const std::string& frame,
                                                        const StampedPose& newest,
                                                        std::int64_t when_ns,
                                                        const std::string& smooth) {
  if (newest.stamp_ns <= kVelocityBaseNs) return newest.T_fixed_frame;
  const auto inSmooth = [&](std::int64_t stamp_ns) -> std::optional<StampedPose> {
    ros::Time stamp;
    stamp.fromNSec(static_cast<std::uint64_t>(stamp_ns));
    const auto T_fixed_smooth = at(smooth, stamp), T_fixed_frame = at(frame, stamp);
    if (!T_fixed_smooth || !T_fixed_frame) return std::nullopt;
    return StampedPose{T_fixed_smooth->inverse() * *T_fixed_frame, stamp_ns};
  };
  const auto earlier = inSmooth(newest.stamp_ns - kVelocityBaseNs),
             later = inSmooth(newest.stamp_ns);
  if (!earlier || !later || hasJumped(earlier->T_fixed_frame, later->T_fixed_frame)) {
    return newest.T_fixed_frame;
  }
  const std::int64_t farthest_ns = newest.stamp_ns + kFarthestAheadNs;
  if (when_ns > farthest_ns && hasMoved(earlier->T_fixed_frame, later->T_fixed_frame)) {
    return std::nullopt;
  }
  return newest.T_fixed_frame * later->T_fixed_frame.inverse() *
         extrapolate(*earlier, *later, std::min(when_ns, farthest_ns));
}

bool FrameLookup::isCarried(const std::string& frame, const std::string& carrier) const {
  std::string parent;
  std::string child = frame;
  for (int i = 0; i < kMostLinks && child != carrier; ++i, child = parent) {
    if (!buffer_._getParent(child, ros::Time(0), parent)) return false;
  }
  return child == carrier;
}

/// Looks both ways up from the frames; a static link has no age.
std::string FrameLookup::oldestLink(const std::string& frame) const {
  std::int64_t oldest_ns = now_ns_;
  std::string words;
  for (std::string child : {frame, fixed_frame_}) {
    std::string parent;
    for (int i = 0; i < kMostLinks && buffer_._getParent(child, ros::Time(0), parent); ++i) {
      const auto stamp_ns = stampOfLink(buffer_, parent, child);
      if (stamp_ns != 0 && stamp_ns < oldest_ns) {
        oldest_ns = stamp_ns;
        words = ": '" + printable(child) + "' in '" + printable(parent) + "' is " +
                std::to_string((now_ns_ - stamp_ns) / 1'000'000'000) + " s old";
      }
      child = parent;
    }
  }
  return words;
}

void FrameLookup::forget(std::int64_t now_ns) {
  known_.clear();
  now_ns_ = now_ns;
}

std::optional<StampedPose> FrameLookup::look(const std::string& frame, ros::Time stamp) const {
  // The fixed frame's own pose is known even while tf does not know the frame.
  if (frame == fixed_frame_) return StampedPose{Eigen::Isometry3d::Identity(), 0};
  if (!isFrameName(frame) || !isFrameName(fixed_frame_)) return std::nullopt;
  try {
    if (!buffer_.canTransform(fixed_frame_, frame, stamp)) return std::nullopt;
    const auto found = buffer_.lookupTransform(fixed_frame_, frame, stamp);
    const geometry_msgs::Vector3& t = found.transform.translation;
    if (!toVector(t.x, t.y, t.z)) return std::nullopt;  // a long chain may lead too far
    return StampedPose{toIsometry(found.transform),
                       static_cast<std::int64_t>(found.header.stamp.toNSec())};
  } catch (const tf2::TransformException&) {
    return std::nullopt;  // frame names that tf2 refuses, loops, times beyond its cache
  }
}

Eigen::Isometry3d extrapolate(const StampedPose& earlier, const StampedPose& later,
                              std::int64_t when_ns) {
  if (earlier.stamp_ns >= later.stamp_ns) {
    throw std::logic_error("extrapolate: the poses are not in order");
  }
  const double share = static_cast<double>(when_ns - later.stamp_ns) /
                       static_cast<double>(later.stamp_ns - earlier.stamp_ns);
  const Eigen::Isometry3d& b = later.T_fixed_frame;
  const Eigen::Isometry3d step = b * earlier.T_fixed_frame.inverse();
  const Eigen::AngleAxisd turn(step.linear());
  const Eigen::Vector3d& n = turn.axis();
  const Eigen::Vector3d t = step.translation();
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  if (turn.angle() < kLeastTurn) {
    // Without a turn: the movement of `b`, not that of the origin by `step`.
    motion.translation() = share * (b.translation() - earlier.T_fixed_frame.translation());
    return motion * b;
  }
  const Eigen::Vector3d along = n.dot(t) * n, across = t - along;
  // The point of the axis that is nearest to the origin: points of the axis move only along it.
  const Eigen::Vector3d pivot = (across + n.cross(across) / std::tan(turn.angle() / 2)) / 2;
  motion.rotate(Eigen::AngleAxisd(share * turn.angle(), n));
  motion.translation() = pivot - motion.linear() * pivot + share * along;
  return motion * b;
}

}  // namespace afterglow::nodes
