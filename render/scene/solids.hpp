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
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// How round: coarse is for lists of hundreds.
enum class Roundness { Fine, Coarse };

const Solid& unitCube();
const Solid& unitSphere(Roundness roundness);
const Solid& unitCylinder();
const Solid& unitCone();

}  // namespace afterglow::render
