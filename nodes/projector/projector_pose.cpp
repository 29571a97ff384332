#include "nodes/projector/projector_pose.hpp"

#include <cmath>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

/// Radians; below it the axis is all noise, and far away.
constexpr double kLeastTurn = 1e-6;

}  // namespace

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
  const Eigen::Vector3d n = turn.axis(), t = step.translation();
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  if (turn.angle() < kLeastTurn) {
    // Nowhere to turn about: how `b` moved, not what `step` would move at the origin.
    motion.translation() = share * (b.translation() - earlier.T_fixed_frame.translation());
    return motion * b;
  }
  const Eigen::Vector3d along = n.dot(t) * n, across = t - along;
  // The point of the axis that is nearest to the origin: it alone does not move across the axis.
  const Eigen::Vector3d pivot = (across + n.cross(across) / std::tan(turn.angle() / 2)) / 2;
  motion.rotate(Eigen::AngleAxisd(share * turn.angle(), n));
  motion.translation() = pivot - motion.linear() * pivot + share * along;
  return motion * b;
}

}  // namespace afterglow::nodes
