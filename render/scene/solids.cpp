#include "render/scene/solids.hpp"

#include <cmath>

namespace afterglow::render {
namespace {

constexpr int kSegments = 32;  // an outline 0.5 % of the radius inside the circle

Eigen::Vector3d onCircle(int i, int count, double radius, double z) {
  const double angle = 2 * M_PI * i / count;
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

std::uint32_t add(Solid& solid, const Eigen::Vector3d& p) {
  solid.points.push_back(p);
  return static_cast<std::uint32_t>(solid.points.size() - 1);
}

/// A ring of `count` points; returns the index of its first.
std::uint32_t addRing(Solid& solid, int count, double radius, double z) {
  const auto first = static_cast<std::uint32_t>(solid.points.size());
  for (int i = 0; i < count; ++i) solid.points.push_back(onCircle(i, count, radius, z));
  return first;
}

void joinRings(Solid& solid, std::uint32_t below, std::uint32_t above, int count) {
  for (int i = 0; i < count; ++i) {
    const std::uint32_t j = static_cast<std::uint32_t>((i + 1) % count), k = i;
    solid.triangles.push_back({below + k, below + j, above + j});
    solid.triangles.push_back({below + k, above + j, above + k});
  }
}

/// Triangles from a point to a ring.
void joinTip(Solid& solid, std::uint32_t tip, std::uint32_t ring, int count, bool ring_below) {
  for (int i = 0; i < count; ++i) {
    const std::uint32_t k = ring + i, j = ring + static_cast<std::uint32_t>((i + 1) % count);
    if (ring_below) {
      solid.triangles.push_back({k, j, tip});
    } else {
      solid.triangles.push_back({j, k, tip});
    }
  }
}

Solid makeCube() {
  Solid cube;
  for (int i = 0; i < 8; ++i) {
    cube.points.emplace_back(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
  }
  // Counterclockwise from outside.
  const std::array<std::uint32_t, 4> faces[] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : faces) {
    cube.triangles.push_back({f[0], f[1], f[2]});
    cube.triangles.push_back({f[0], f[2], f[3]});
  }
  return cube;
}

Solid makeSphere(int slices, int stacks) {
  Solid sphere;
  const std::uint32_t south = add(sphere, {0, 0, -0.5});
  std::uint32_t previous = 0;
  for (int i = 1; i < stacks; ++i) {
    const double polar = M_PI * i / stacks;
    const std::uint32_t ring =
        addRing(sphere, slices, 0.5 * std::sin(polar), -0.5 * std::cos(polar));
    if (i == 1) {
      joinTip(sphere, south, ring, slices, false);
    } else {
      joinRings(sphere, previous, ring, slices);
    }
    previous = ring;
  }
  joinTip(sphere, add(sphere, {0, 0, 0.5}), previous, slices, true);
  return sphere;
}

Solid makeCylinder() {
  Solid cylinder;
  const std::uint32_t bottom = addRing(cylinder, kSegments, 0.5, -0.5);
  const std::uint32_t top = addRing(cylinder, kSegments, 0.5, 0.5);
  joinRings(cylinder, bottom, top, kSegments);
  joinTip(cylinder, add(cylinder, {0, 0, -0.5}), bottom, kSegments, false);
  joinTip(cylinder, add(cylinder, {0, 0, 0.5}), top, kSegments, true);
  return cylinder;
}

Solid makeCone() {
  Solid cone;
  const std::uint32_t base = addRing(cone, kSegments, 0.5, 0);
  joinTip(cone, add(cone, {0, 0, 1}), base, kSegments, true);
  joinTip(cone, add(cone, {0, 0, 0}), base, kSegments, false);
  // Around x instead of z: a rotation of the axes, so that the winding stays.
  for (Eigen::Vector3d& p : cone.points) p = Eigen::Vector3d(p.z(), p.x(), p.y());
  return cone;
}

}  // namespace

const Solid& unitCube() {
  static const Solid cube = makeCube();
  return cube;
}

const Solid& unitSphere(Roundness roundness) {
  static const Solid fine = makeSphere(kSegments, 16), coarse = makeSphere(14, 8);
  return roundness == Roundness::Fine ? fine : coarse;
}

const Solid& unitCylinder() {
  static const Solid cylinder = makeCylinder();
  return cylinder;
}

const Solid& unitCone() {
  static const Solid cone = makeCone();
  return cone;
}

}  // namespace afterglow::render
