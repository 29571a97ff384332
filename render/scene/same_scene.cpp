#include "render/scene/same_scene.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace afterglow::render {
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
