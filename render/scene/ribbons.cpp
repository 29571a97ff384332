#include "render/scene/ribbons.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace afterglow::render {
namespace {

/// Unit vector from a point towards the eye.
Eigen::Vector3d towards(const Eye& eye, const Eigen::Vector3d& p_world) {
  if (eye.parallel) return -eye.R_world_eye.col(2);
  return (eye.p_world - p_world).normalized();
}

std::uint32_t add(Mesh& mesh, const Eigen::Vector3d& p, const Rgba& color) {
  mesh.points.push_back(p);
  mesh.colors.push_back(color);
  return static_cast<std::uint32_t>(mesh.points.size() - 1);
}

/// Half the width, across the segment and across the line of sight; zero where they coincide.
Eigen::Vector3d sideways(const Eye& eye, const Eigen::Vector3d& along, const Eigen::Vector3d& p,
                         double width) {
  const Eigen::Vector3d side = along.cross(towards(eye, p));
  const double length = side.norm();
  if (!(length > 1e-12 * along.norm())) return Eigen::Vector3d::Zero();
  return side * (0.5 * width / length);
}

void addSegment(const RibbonPoint& a, const RibbonPoint& b, double width, const Eye& eye,
                Mesh& mesh) {
  if (!a.p_world.allFinite() || !b.p_world.allFinite()) return;
  const Eigen::Vector3d along = b.p_world - a.p_world;
  const Eigen::Vector3d side_a = sideways(eye, along, a.p_world, width);
  const Eigen::Vector3d side_b = sideways(eye, along, b.p_world, width);
  const std::uint32_t first = add(mesh, a.p_world - side_a, a.color);
  add(mesh, b.p_world - side_b, b.color);
  add(mesh, b.p_world + side_b, b.color);
  add(mesh, a.p_world + side_a, a.color);
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

/// A disc of the line's width where two segments meet.
void addJoin(const RibbonPoint& point, double width, const Eye& eye, Mesh& mesh) {
  constexpr int kSides = 12;
  const Eigen::Vector3d n = towards(eye, point.p_world);
  if (n.isZero()) return;  // in the eye itself there is no side
  const Eigen::Vector3d x = n.unitOrthogonal() * (0.5 * width), y = n.cross(x);
  const std::uint32_t center = add(mesh, point.p_world, point.color);
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * M_PI * i / kSides;
    add(mesh, point.p_world + std::cos(angle) * x + std::sin(angle) * y, point.color);
    const std::uint32_t k = static_cast<std::uint32_t>(i);
    mesh.triangles.push_back({center, center + 1 + k, center + 1 + (k + 1) % kSides});
  }
}

}  // namespace

void addStrip(const std::vector<RibbonPoint>& points, double width, const Eye& eye, Mesh& mesh) {
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    addSegment(points[i], points[i + 1], width, eye, mesh);
    if (i > 0 && points[i].p_world.allFinite()) addJoin(points[i], width, eye, mesh);
  }
}

void addSegments(const std::vector<RibbonPoint>& points, double width, const Eye& eye, Mesh& mesh) {
  for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
    addSegment(points[i], points[i + 1], width, eye, mesh);
  }
}

}  // namespace afterglow::render
