/// \file
/// Shapes into triangles and points. Sizes and forms are RViz's (scene.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/scene/eye.hpp"
#include "render/scene/mesh.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// A line of so many pixels' width.
struct ThinLine {
  Eigen::Vector3d from, to;  ///< world
  Rgba from_color, to_color;
  double width_px;
};

/// Reused from drawable to drawable, so that steady scenes allocate nothing.
struct Tessellation {
  Mesh mesh;
  std::vector<Splat> splats;         ///< PointStyle::Points only
  std::vector<ThinLine> thin_lines;  ///< Lines with width_px only
  /// The beginnings of the points of each convex part; empty if the mesh has any other part.
  std::vector<std::uint32_t> convex_parts;
};

/// The most corners that one list or cloud becomes: round things have fewer sides where they are
/// many, and of still more things every second, third, ... is drawn. (Small things become outlines
/// instead, all of them: sprites.hpp.)
constexpr std::size_t kMostCorners = std::size_t{1} << 20;

/// The least corners that a shape becomes, or its points, if those are more.
std::size_t cornersOf(const Shape& shape);

/// Replaces what `out` held. Points that are not finite are left out, and with them the lines,
/// triangles and bodies that they belong to.
void tessellate(const Drawable& drawable, const Eye& eye, Tessellation& out);

}  // namespace afterglow::render
