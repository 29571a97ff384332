#include "render/scene/scene.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <type_traits>

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

namespace {

template <typename T>
bool isSame(const SharedList<T>& one, const SharedList<T>& other) {
  const std::vector<T>&a = one.get(), &b = other.get();
  return &a == &b || (a.size() == b.size() &&
                      (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0));
}

bool isSame(const Arrow& a, const Arrow& b) {
  return a.length == b.length && a.shaft_diameter == b.shaft_diameter &&
         a.head_diameter == b.head_diameter && a.head_length == b.head_length;
}
bool isSame(const Cube& a, const Cube& b) { return a.size == b.size; }
bool isSame(const Sphere& a, const Sphere& b) { return a.size == b.size; }
bool isSame(const Cylinder& a, const Cylinder& b) { return a.size == b.size; }
bool isSame(const Lines& a, const Lines& b) {
  return a.width == b.width && a.strip == b.strip && a.width_px == b.width_px &&
         isSame(a.points, b.points) && isSame(a.colors, b.colors);
}
bool isSame(const ShapeList& a, const ShapeList& b) {
  return a.kind == b.kind && a.size == b.size && isSame(a.points, b.points) &&
         isSame(a.colors, b.colors);
}
bool isSame(const Triangles& a, const Triangles& b) {
  return isSame(a.points, b.points) && isSame(a.colors, b.colors);
}
bool isSame(const PointCloud& a, const PointCloud& b) {
  return a.style == b.style && a.size == b.size && a.size_y == b.size_y &&
         isSame(a.points, b.points) && isSame(a.colors, b.colors);
}
bool isSame(const Text& a, const Text& b) { return a.letters == b.letters; }
bool isSame(const MeshInstance& a, const MeshInstance& b) {
  return a.body == b.body && a.scale == b.scale && a.own_colors == b.own_colors;
}

template <typename Target, typename Source>
bool isSame(const Rigid<Target, Source>& a, const Rigid<Target, Source>& b) {
  return a.matrix().matrix() == b.matrix().matrix();
}

bool isSame(const SurfacePatch& a, const SurfacePatch& b) {
  return a.name == b.name && a.polygon == b.polygon && a.relief == b.relief &&
         isSame(a.T_world_surface, b.T_world_surface);
}

bool isSame(const std::optional<SurfacePatch>& a, const std::optional<SurfacePatch>& b) {
  return a.has_value() == b.has_value() && (!a || isSame(*a, *b));
}

bool isSame(const Layer& a, const Layer& b) {
  return a.name == b.name && a.placement == b.placement && a.gain == b.gain &&
         a.p_viewer == b.p_viewer && isSame(a.surface, b.surface) && a.reader == b.reader &&
         std::equal(a.drawables.begin(), a.drawables.end(), b.drawables.begin(), b.drawables.end(),
                    [](const Drawable& x, const Drawable& y) { return render::isSame(x, y); });
}

}  // namespace

bool isSame(const Drawable& a, const Drawable& b) {
  return a.shape.index() == b.shape.index() && a.color == b.color && isSame(a.pose, b.pose) &&
         std::visit(
             [&b](const auto& shape) {
               return isSame(shape, std::get<std::decay_t<decltype(shape)>>(b.shape));
             },
             a.shape);
}

bool isSame(const Scene& a, const Scene& b) {
  return std::equal(a.layers.begin(), a.layers.end(), b.layers.begin(), b.layers.end(),
                    [](const Layer& x, const Layer& y) { return isSame(x, y); }) &&
         std::equal(a.surfaces.begin(), a.surfaces.end(), b.surfaces.begin(), b.surfaces.end(),
                    [](const SurfacePatch& x, const SurfacePatch& y) { return isSame(x, y); });
}

}  // namespace afterglow::render
