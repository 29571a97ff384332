/// \file
/// Values of geometry_msgs and std_msgs as values of the scene, checked: numbers that are not
/// finite and places farther than any projector reaches are refused, and so are frame names that
/// tf2 does not take.
#pragma once

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Pose.h>
#include <geometry_msgs/Transform.h>
#include <geometry_msgs/Vector3.h>
#include <ros/time.h>
#include <std_msgs/ColorRGBA.h>
#include <std_msgs/Header.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "render/scene/scene.hpp"
#include "replay/messages/message.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {

/// Returns true if tf2 looks a frame of this name up: it is not empty and begins with no slash.
/// Asked for another one, tf2 warns each time.
inline bool isFrameName(const std::string& name) { return !name.empty() && name.front() != '/'; }

/// The result of reading a message from the network. Messages are untrusted: a bad one gives a
/// reason to be counted, never an exception. The reason is a stable text (no measured numbers in
/// it), so that a stream of equal faults counts as one.
template <typename T>
struct Converted {
  std::optional<T> value;
  std::string reason;  ///< the reason why there is no value; beside a value: its oddity
};

template <typename T>
Converted<T> refused(std::string reason) {
  return {std::nullopt, std::move(reason)};
}

constexpr double kFarthest = 1e6;  ///< meters; beyond it a coordinate is absurd, not far away
constexpr std::size_t kMostPoints = std::size_t{1} << 22;  ///< limit of a message; more is refused

/// Meters. Empty if a coordinate is not finite or beyond kFarthest.
std::optional<Eigen::Vector3f> toVector(double x, double y, double z);

/// Components clamped to 0..1 (authors send 255). Empty if one is not a number.
std::optional<render::Color> toColor(const std_msgs::ColorRGBA& color);

/// An all-zero orientation is the identity, as RViz has it; others are normalized, with a remark
/// when they are more than 1 % off. Refused: not finite, absurdly far, an orientation of no length.
Converted<Eigen::Isometry3d> toPose(const geometry_msgs::Pose& pose);

Eigen::Isometry3d toIsometry(const geometry_msgs::Transform& transform);
geometry_msgs::Transform toTransform(const Eigen::Isometry3d& T_parent_child);

/// A pose on the parent's floor, z = 0.
Eigen::Isometry3d toIsometry(const replay::PlanarPose& pose);
/// The pose seen from above: its place, and the direction of its x axis.
replay::PlanarPose toPlanarPose(const Eigen::Isometry3d& T_parent_child);

/// The earliest time that ROS has for stamps before it.
ros::Time toTime(replay::Stamp stamp);
replay::Stamp toStamp(const ros::Time& time);

/// Returns why content with this header cannot be placed (a frame without a name, a stamp that is
/// no time); else empty.
std::string headerFault(const std_msgs::Header& header);

/// Returns the name without the leading slash that old messages have and tf2 does not know.
std::string frameName(const std::string& frame_id);

/// A name from the network, fit for a status line: printable ASCII and short.
std::string printable(const std::string& name);

}  // namespace afterglow::nodes
