#include "nodes/projector/projector_pose.hpp"

#include <stdexcept>

namespace afterglow::nodes {

Eigen::Isometry3d extrapolate(const StampedPose& earlier, const StampedPose& later,
                              std::int64_t when_ns) {
  if (earlier.stamp_ns >= later.stamp_ns) {
    throw std::logic_error("extrapolate: the poses are not in order");
  }
  const double share = static_cast<double>(when_ns - later.stamp_ns) /
                       static_cast<double>(later.stamp_ns - earlier.stamp_ns);
  const Eigen::Isometry3d& a = earlier.T_fixed_frame;
  const Eigen::Isometry3d& b = later.T_fixed_frame;
  const Eigen::AngleAxisd turn(b.linear() * a.linear().transpose());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::AngleAxisd(share * turn.angle(), turn.axis()).toRotationMatrix() * b.linear();
  pose.translation() = b.translation() + share * (b.translation() - a.translation());
  return pose;
}

}  // namespace afterglow::nodes
