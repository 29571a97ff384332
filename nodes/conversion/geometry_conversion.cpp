#include "nodes/conversion/geometry_conversion.hpp"

#include <algorithm>
#include <cmath>

#include "replay/messages/topic_name.hpp"

namespace afterglow::nodes {

std::optional<Eigen::Vector3f> toVector(double x, double y, double z) {
  // Written so that NaN fails, too.
  const auto fits = [](double value) { return std::abs(value) <= kFarthest; };
  if (!fits(x) || !fits(y) || !fits(z)) return std::nullopt;
  return Eigen::Vector3d(x, y, z).cast<float>();
}

std::optional<render::Color> toColor(const std_msgs::ColorRGBA& color) {
  if (!std::isfinite(color.r) || !std::isfinite(color.g) || !std::isfinite(color.b) ||
      !std::isfinite(color.a)) {
    return std::nullopt;
  }
  const auto clamp = [](float component) { return std::clamp(component, 0.0f, 1.0f); };
  return render::Color{clamp(color.r), clamp(color.g), clamp(color.b), clamp(color.a)};
}

Converted<Eigen::Isometry3d> toPose(const geometry_msgs::Pose& pose) {
  const auto position = toVector(pose.position.x, pose.position.y, pose.position.z);
  if (!position) return refused<Eigen::Isometry3d>("position is not finite or absurdly far");
  Eigen::Quaterniond rotation(pose.orientation.w, pose.orientation.x, pose.orientation.y,
                              pose.orientation.z);
  const double norm = rotation.norm();
  if (!std::isfinite(norm)) return refused<Eigen::Isometry3d>("orientation is not finite");
  if (norm == 0) {
    rotation.setIdentity();
  } else if (norm < 1e-6) {
    return refused<Eigen::Isometry3d>("orientation has no length");
  }
  Eigen::Isometry3d T_frame_pose = Eigen::Isometry3d::Identity();
  T_frame_pose.linear() = rotation.normalized().toRotationMatrix();
  T_frame_pose.translation() << pose.position.x, pose.position.y, pose.position.z;
  const bool odd = norm != 0 && std::abs(norm - 1) > 0.01;
  return {T_frame_pose, odd ? "orientation is not normalized" : ""};
}

Eigen::Isometry3d toIsometry(const geometry_msgs::Transform& transform) {
  const geometry_msgs::Quaternion& q = transform.rotation;
  Eigen::Isometry3d T_parent_child = Eigen::Isometry3d::Identity();
  T_parent_child.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  T_parent_child.translation() << transform.translation.x, transform.translation.y,
      transform.translation.z;
  return T_parent_child;
}

Eigen::Isometry3d toIsometry(const replay::PlanarPose& pose) {
  return Eigen::Translation3d(pose.x, pose.y, 0) *
         Eigen::AngleAxisd(pose.yaw, Eigen::Vector3d::UnitZ());
}

replay::PlanarPose toPlanarPose(const Eigen::Isometry3d& T_parent_child) {
  const Eigen::Vector3d p = T_parent_child.translation(), ahead = T_parent_child.linear().col(0);
  return {p.x(), p.y(), std::atan2(ahead.y(), ahead.x())};
}

geometry_msgs::Transform toTransform(const Eigen::Isometry3d& T_parent_child) {
  const Eigen::Quaterniond q(T_parent_child.rotation());
  geometry_msgs::Transform transform;
  transform.translation.x = T_parent_child.translation().x();
  transform.translation.y = T_parent_child.translation().y();
  transform.translation.z = T_parent_child.translation().z();
  transform.rotation.x = q.x();
  transform.rotation.y = q.y();
  transform.rotation.z = q.z();
  transform.rotation.w = q.w();
  return transform;
}

std::string headerFault(const std_msgs::Header& header) {
  const std::string name = frameName(header.frame_id);
  if (name.empty()) return "frame_id is empty";
  if (!isFrameName(name)) {
    return "frame_id '" + printable(header.frame_id) + "' begins with more than one '/'";
  }
  if (header.stamp.nsec >= 1'000'000'000u) return "stamp is no time";
  return {};
}

ros::Time toTime(replay::Stamp stamp) {
  ros::Time time;
  time.fromNSec(static_cast<std::uint64_t>(std::max<std::int64_t>(0, stamp.ns)));
  return time;
}

replay::Stamp toStamp(const ros::Time& time) { return {static_cast<std::int64_t>(time.toNSec())}; }

std::string frameName(const std::string& frame_id) { return replay::bareName(frame_id); }

std::string printable(const std::string& name) {
  constexpr std::size_t kLongest = 80;
  std::string text = name.substr(0, kLongest);
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '?';
  }
  return name.size() > kLongest ? text + "..." : text;
}

}  // namespace afterglow::nodes
