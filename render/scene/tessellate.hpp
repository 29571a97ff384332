/// \file
/// Shapes into triangles and points. Sizes and forms are RViz's (scene.hpp).
///
/// Unit bodies as triangles, made once: cube, sphere, cylinder (all of diameter 1 around the
/// origin, the cylinder along z) and cone (base of diameter 1 in x = 0, tip in x = 1).
#pragma once

#include <Eigen/Core>
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

struct Solid {
  std::vector<Eigen::Vector3d> points;
  /// Counterclockwise as seen from outside.
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Round outlines have so many sides: the next greater number that there is, at most kMostSides.
/// They enclose a circle's area, so that their mean radius is right.
constexpr int kLeastSides = 12, kMostSides = 192;
/// The greatest number that there is up to this one, which is at least kLeastSides.
int sidesUpTo(int sides);
const Solid& unitCube();
const Solid& unitSphere(int sides);
const Solid& unitCylinder(int sides);
const Solid& unitCone(int sides);

/// The part of the unit sphere that is seen from a point outside it, or from far away in a
/// direction: its outline is exact, whatever the sides. Replaces what `out` held.
void seenOfUnitSphere(const Eigen::Vector3d& eye, bool is_direction, int sides, Solid& out);

}  // namespace afterglow::render
