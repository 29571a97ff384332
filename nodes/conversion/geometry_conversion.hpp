/// \file
/// geometry_msgs and std_msgs values as the scene's, checked: what is not finite, or farther than
/// any projector throws, has no value.
#pragma once

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Pose.h>
#include <geometry_msgs/Transform.h>
#include <geometry_msgs/Vector3.h>
#include <std_msgs/ColorRGBA.h>
#include <std_msgs/Header.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "nodes/conversion/converted.hpp"
#include "render/scene/scene.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {

constexpr double kFarthest = 1e6;  ///< metres; beyond it a coordinate is absurd, not far away
constexpr std::size_t kMostPoints = std::size_t{1} << 22;  ///< in one message; more is refused

/// Metres. Empty if a coordinate is not finite or beyond kFarthest.
std::optional<Eigen::Vector3f> toVector(double x, double y, double z);

/// Components clamped to 0..1 (authors send 255). Empty if one is not a number.
std::optional<render::Color> toColor(const std_msgs::ColorRGBA& color);

/// An all-zero orientation is the identity, as RViz has it; others are normalized, with a remark
/// when they are more than 1 % off. Refused: not finite, absurdly far, an orientation of no length.
Converted<Eigen::Isometry3d> toPose(const geometry_msgs::Pose& pose);

Eigen::Isometry3d toIsometry(const geometry_msgs::Transform& transform);
geometry_msgs::Transform toTransform(const Eigen::Isometry3d& T_parent_child);

/// On the floor of the parent, z = 0.
Eigen::Isometry3d toIsometry(const replay::PlanarPose& pose);
/// Seen from above: where its x points.
replay::PlanarPose toPlanarPose(const Eigen::Isometry3d& T_parent_child);

/// Why content with this header has no place at all, or empty: a frame without a name, a stamp that
/// is no time.
std::string headerFault(const std_msgs::Header& header);

/// tf2 names carry no leading slash; messages from tf's days do.
std::string frameName(const std::string& frame_id);

/// A name from the network, fit for a status line: printable ASCII and short.
std::string printable(const std::string& name);

}  // namespace afterglow::nodes
