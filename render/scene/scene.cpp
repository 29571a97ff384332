#include "render/scene/scene.hpp"

#include <stdexcept>

namespace afterglow::render {
namespace {

const SurfacePatch& surfaceOf(const Layer& layer) {
  if (!layer.surface) {
    throw std::logic_error("layer " + layer.name + " is placed on a surface but has none");
  }
  return *layer.surface;
}

/// p - n (n . (p - o)): along the normal onto the plane.
Eigen::Matrix4d drapeMatrix(const Eigen::Vector3d& n, const Eigen::Vector3d& o) {
  Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
  M.topLeftCorner<3, 3>() -= n * n.transpose();
  M.topRightCorner<3, 1>() = n * n.dot(o);
  return M;
}

/// e + (p - e) D / (D - h) with D and h the heights of eye and point over the plane, as a
/// homogeneous matrix: rows scaled by D so that w = (D - h) / D is 1 on the plane.
Eigen::Matrix4d viewerMatrix(const Eigen::Vector3d& n, const Eigen::Vector3d& o,
                             const Eigen::Vector3d& eye) {
  const double D = n.dot(eye - o);
  Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
  M.bottomLeftCorner<1, 3>() = -n.transpose() / D;
  M(3, 3) = 1 + n.dot(o) / D;
  // e w + (p - e) with w as above.
  M.topLeftCorner<3, 3>() += eye * M.bottomLeftCorner<1, 3>();
  M.topRightCorner<3, 1>() = eye * (M(3, 3) - 1);
  return M;
}

}  // namespace

const PointCloud* pixelCloud(const Shape& shape) {
  const auto* cloud = std::get_if<PointCloud>(&shape);
  return cloud != nullptr && cloud->style == PointStyle::Points ? cloud : nullptr;
}

Eigen::Matrix4d placementMatrix(const Layer& layer) {
  if (layer.placement == Placement::Direct) return Eigen::Matrix4d::Identity();
  const Eigen::Isometry3d& surface = surfaceOf(layer).T_world_surface.matrix();
  const Eigen::Vector3d n = surface.linear().col(2), o = surface.translation();
  if (layer.placement == Placement::Drape) return drapeMatrix(n, o);
  if (!(n.dot(layer.p_viewer - o) > 1e-6)) {
    throw std::logic_error("layer " + layer.name + ": the viewer is not above the surface " +
                           layer.surface->name);
  }
  return viewerMatrix(n, o, layer.p_viewer);
}

}  // namespace afterglow::render
