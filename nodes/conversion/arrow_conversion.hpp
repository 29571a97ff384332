/// \file
/// The two forms of an ARROW marker. Semantics: RViz 1.14, markers/arrow_marker.cpp.
#pragma once

#include <Eigen/Geometry>

#include "nodes/conversion/converted.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

struct PlacedArrow {
  Eigen::Isometry3d T_marker_arrow = Eigen::Isometry3d::Identity();
  /// An Arrow; Triangles where width and height differ, for then its cross-section is an ellipse.
  render::Shape shape;
};

/// Without points: along +x, scale = length, width, height (height 0: as the width), shaft 77 % and
/// head 23 % of the length, the head twice as wide. With two: from the first to the second, scale =
/// shaft diameter, head diameter, head length (at most the distance; 0: 23 % of it).
/// Refused: another number of points, a length or width that is not positive.
Converted<PlacedArrow> toArrow(const render::PointList& points, const Eigen::Vector3f& scale);

}  // namespace afterglow::nodes
