#include "render/scene/surface_outline.hpp"

namespace afterglow::render {

Eigen::Vector4d heightRow(const SurfacePatch& surface) {
  const Eigen::Isometry3d& T = surface.T_world_surface.matrix();
  const Eigen::Vector3d n = T.linear().col(2);
  return {n.x(), n.y(), n.z(), -n.dot(T.translation())};
}

std::vector<Eigen::Vector3d> outlineInWorld(const SurfacePatch& surface) {
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector2d& corner : surface.polygon) {
    corners.push_back(surface.T_world_surface.matrix() *
                      Eigen::Vector3d(corner.x(), corner.y(), 0));
  }
  return corners;
}

bool isSame(const SurfacePatch& a, const SurfacePatch& b) {
  return a.name == b.name && a.polygon == b.polygon &&
         a.T_world_surface.matrix().matrix() == b.T_world_surface.matrix().matrix();
}

std::vector<Eigen::Vector3d> partBefore(const SurfacePatch& surface,
                                        const std::vector<Eigen::Vector3d>& outline,
                                        const Eigen::Vector3d& p_lens) {
  constexpr double kClearance = 0.003;  // meters; closer things lie on the surface
  const Eigen::Vector4d row = heightRow(surface);
  const double side = row.dot(p_lens.homogeneous()) < 0 ? -1 : 1;
  const auto clearance = [&](const Eigen::Vector3d& p) {
    return side * row.dot(p.homogeneous()) - kClearance;
  };
  std::vector<Eigen::Vector3d> part;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector3d &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const double at_a = clearance(a), at_b = clearance(b);
    if (at_a >= 0) part.push_back(a);
    if ((at_a >= 0) != (at_b >= 0)) part.push_back(a + (b - a) * (at_a / (at_a - at_b)));
  }
  return part;
}

}  // namespace afterglow::render
