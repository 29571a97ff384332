/// \file
/// Axes and arrows at the poses of a path, all in one body, so that a thousand of them are one
/// thing to draw and nothing to copy. Shapes: RViz 1.14's Axes and Arrow.
#pragma once

#include <Eigen/Geometry>

#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// Cylinders from the pose along x (red), y (green) and z (blue).
void addAxes(const Eigen::Isometry3d& pose, float length, float diameter, render::Body& body);

/// From the pose along x, without colors of its own.
void addArrow(const Eigen::Isometry3d& pose, const render::Arrow& arrow, render::Body& body);

}  // namespace afterglow::nodes
