/// \file
/// Unit bodies as triangles, made once: cube, sphere, cylinder (all of diameter 1 around the
/// origin, the cylinder along z) and cone (base of diameter 1 in x = 0, tip in x = 1).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace afterglow::render {

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
