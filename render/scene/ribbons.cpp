#include "render/scene/ribbons.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace afterglow::render {
namespace {

/// Unit vector from a point toward the eye.
Eigen::Vector3d toward(const Eye& eye, const Eigen::Vector3d& p_world) {
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
  const Eigen::Vector3d side = along.cross(toward(eye, p));
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

/// The gap between the ends of two segments on the outer side of their corner: part of a disc
/// of the line's width.
void addJoin(const RibbonPoint& from, const RibbonPoint& point, const RibbonPoint& to, double width,
             const Eye& eye, Mesh& mesh) {
  if (!from.p_world.allFinite() || !point.p_world.allFinite() || !to.p_world.allFinite()) return;
  constexpr double kStep = M_PI / 6;
  const Eigen::Vector3d n = toward(eye, point.p_world);
  Eigen::Vector3d a = sideways(eye, point.p_world - from.p_world, point.p_world, width);
  Eigen::Vector3d b = sideways(eye, to.p_world - point.p_world, point.p_world, width);
  const double turn = std::atan2(a.cross(b).dot(n), a.dot(b));
  if (turn > 0) {  // sideways is on the right-hand side, as the eye sees it
    a = -a;
    b = -b;
  }
  const int steps = static_cast<int>(std::ceil(std::abs(turn) / kStep));
  const std::uint32_t center = add(mesh, point.p_world, point.color);
  std::uint32_t last = add(mesh, point.p_world + a, point.color);
  for (int i = 1; i <= steps; ++i) {
    const Eigen::Vector3d side = Eigen::AngleAxisd(turn * i / steps, n) * a;
    const std::uint32_t next = add(mesh, point.p_world + side, point.color);
    mesh.triangles.push_back({center, last, next});
    last = next;
  }
}

}  // namespace

void addStrip(const std::vector<RibbonPoint>& points, double width, const Eye& eye, Mesh& mesh) {
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    addSegment(points[i], points[i + 1], width, eye, mesh);
    if (i > 0) addJoin(points[i - 1], points[i], points[i + 1], width, eye, mesh);
  }
}

void addSegments(const std::vector<RibbonPoint>& points, double width, const Eye& eye, Mesh& mesh) {
  for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
    addSegment(points[i], points[i + 1], width, eye, mesh);
  }
}

}  // namespace afterglow::render
