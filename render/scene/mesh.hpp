/// \file
/// Shapes as colored triangles and pixel-sized points.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "render/scene/color.hpp"

namespace afterglow::render {

/// World coordinates, meters. A vertex is shared by the triangles of one smooth or flat body;
/// triangles have no winding: both sides are seen.
struct Mesh {
  std::vector<Eigen::Vector3d> points;
  std::vector<Rgba> colors;  ///< a color for each point
  std::vector<std::array<std::uint32_t, 3>> triangles;

  void clear() {
    points.clear();
    colors.clear();
    triangles.clear();
  }
};

/// A square on the image, whatever its distance.
struct Splat {
  Eigen::Vector3d p_world;
  Rgba color;
  float size_px = 1;
};

}  // namespace afterglow::render
