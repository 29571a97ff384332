/// \file
/// Tables and floors in clouds of points.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

namespace afterglow::render {

struct PlaneSearch {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< rough direction of the plane's normal
  double max_tilt = 0.17;                         ///< radians between the two
  double max_distance = 0.01;                     ///< distance of a point from its plane, meters
  double least_area = 0.02;                       ///< square meters
};

struct FoundPlane {
  /// Origin in the middle of the plane's part, z up along its normal, x along the points' x as far
  /// as the plane allows.
  Eigen::Isometry3d T_points_plane = Eigen::Isometry3d::Identity();
  /// Outline of the part, meters in the plane's frame, counterclockwise; it may be concave.
  std::vector<Eigen::Vector2d> polygon;
  double area = 0;        ///< square meters
  std::size_t count = 0;  ///< points on it
  double residual = 0;    ///< root mean square of their distances from the plane, meters
};

/// The plane with the largest area of points on it that has the wanted direction, and of that the
/// largest connected part: gaps of up to 5 cm do not part it, nor do they and things that stand on
/// it make holes. Points that are not finite count for nothing. The same points give the same
/// plane. Throws std::runtime_error: too few points, or no such plane.
FoundPlane findPlane(const std::vector<Eigen::Vector3d>& points, const PlaneSearch& search);

}  // namespace afterglow::render
