#include "render/scene/solids.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

namespace afterglow::render {
namespace {

constexpr std::array<int, 9> kSides = {kLeastSides, 16, 24, 32, 48, 64, 96, 128, kMostSides};

/// Makes a polygon's area its circle's.
double widened(double radius, int sides) {
  const double angle = 2 * M_PI / sides;
  return radius * std::sqrt(angle / std::sin(angle));
}

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
  radius = widened(radius, count);
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
      solid.triangles.push_back({tip, k, j});
    } else {
      solid.triangles.push_back({tip, j, k});
    }
  }
}

/// The disc within a ring, as a fan around one of its points: each triangle continues the one before.
void addDisc(Solid& solid, std::uint32_t ring, int count, bool from_above) {
  const auto sides = static_cast<std::uint32_t>(count);
  const auto at = [&](std::uint32_t k) { return ring + (from_above ? k : sides - k); };
  for (std::uint32_t k = 1; k + 1 < sides; ++k) {
    solid.triangles.push_back({ring, at(k), at(k + 1)});
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

Solid makeSphere(int slices) {
  const int stacks = slices / 2;
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

Solid makeCylinder(int sides) {
  Solid cylinder;
  const std::uint32_t bottom = addRing(cylinder, sides, 0.5, -0.5);
  const std::uint32_t top = addRing(cylinder, sides, 0.5, 0.5);
  joinRings(cylinder, bottom, top, sides);
  addDisc(cylinder, bottom, sides, false);
  addDisc(cylinder, top, sides, true);
  return cylinder;
}

Solid makeCone(int sides) {
  Solid cone;
  const std::uint32_t base = addRing(cone, sides, 0.5, 0);
  joinTip(cone, add(cone, {0, 0, 1}), base, sides, true);
  addDisc(cone, base, sides, false);
  // Around x instead of z: a rotation of the axes, so that the winding stays.
  for (Eigen::Vector3d& p : cone.points) p = Eigen::Vector3d(p.z(), p.x(), p.y());
  return cone;
}

using Solids = std::array<Solid, kSides.size()>;

Solids makeAll(Solid (*make)(int sides)) {
  Solids solids;
  std::transform(kSides.begin(), kSides.end(), solids.begin(), make);
  return solids;
}

std::size_t indexOf(int sides) {
  const auto enough = std::lower_bound(kSides.begin(), kSides.end() - 1, sides);
  return static_cast<std::size_t>(enough - kSides.begin());
}

}  // namespace

const Solid& unitCube() {
  static const Solid cube = makeCube();
  return cube;
}

const Solid& unitSphere(int sides) {
  static const Solids spheres = makeAll(makeSphere);
  return spheres[indexOf(sides)];
}

const Solid& unitCylinder(int sides) {
  static const Solids cylinders = makeAll(makeCylinder);
  return cylinders[indexOf(sides)];
}

const Solid& unitCone(int sides) {
  static const Solids cones = makeAll(makeCone);
  return cones[indexOf(sides)];
}

/// Returns the sides of a sphere, whose outline is the circle where lines of sight touch it.
/// Between that and the nearest point one more ring makes depths right to a thirtieth of the
/// radius.
int sidesUpTo(int sides) {
  return *std::prev(std::upper_bound(kSides.begin() + 1, kSides.end(), sides));
}

void seenOfUnitSphere(const Eigen::Vector3d& eye, bool is_direction, int sides, Solid& out) {
  out.points.clear();
  out.triangles.clear();
  const int count = kSides[indexOf(sides)];
  Eigen::Matrix3d axes;
  axes.col(2) = eye.normalized();
  axes.col(0) = axes.col(2).unitOrthogonal();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  const double outline = is_direction ? M_PI / 2 : std::acos(0.5 / eye.norm());
  const std::uint32_t tip = add(out, {0, 0, 0.5});
  const auto ring = [&](double polar) {
    return addRing(out, count, 0.5 * std::sin(polar), 0.5 * std::cos(polar));
  };
  const std::uint32_t inner = ring(outline / 2), outer = ring(outline);
  joinTip(out, tip, inner, count, true);
  joinRings(out, outer, inner, count);
  for (Eigen::Vector3d& p : out.points) p = axes * p;
}

}  // namespace afterglow::render
