#include "nodes/observer/room_solids.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/gl/observer_renderer.hpp"
#include "render/scene/relief.hpp"
#include "render/scene/triangulate.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kReach_m = 6;
constexpr double kFloorHeight_m = 0.02;
constexpr float kSlabThickness_m = 0.03f;
/// Things that stand on a surface, or are its table, share its plane: they are in front.
constexpr float kBelow_m = 0.001f;

render::Color paintOf(const render::SurfacePatch& surface) {
  return isFloor(surface) ? render::Color{0.80f, 0.79f, 0.76f, 1}
                          : render::kWoodPaint;
}

Eigen::Vector3f at(const Eigen::Vector2d& p, float z) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), z};
}

render::Outline outlineOf(const render::SurfacePatch& surface, const Eigen::Vector3d& p_world) {
  render::Outline outline = surface.polygon;
  if (outline.empty()) {
    const Eigen::Vector2d middle = (surface.T_world_surface.inverse() * p_world).head<2>();
    for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
      outline.emplace_back(middle + kReach_m * Eigen::Vector2d(x, y));
    }
  }
  if (render::signedArea(outline) < 0) std::reverse(outline.begin(), outline.end());
  return outline;
}

render::Triangles slab(const render::Outline& outline) {
  const float top = -kBelow_m, bottom = top - kSlabThickness_m;
  render::PointList slab;
  for (const auto& t : render::triangulate(outline, {})) {
    for (const std::uint32_t i : t) slab.push_back(at(outline[i], top));
    for (const std::uint32_t i : {t[0], t[2], t[1]}) slab.push_back(at(outline[i], bottom));
  }
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
    for (const auto& p :
         {at(a, bottom), at(b, bottom), at(b, top), at(a, bottom), at(b, top), at(a, top)}) {
      slab.push_back(p);
    }
  }
  return {std::move(slab), {}};
}

render::Triangles landscape(const render::Relief& relief) {
  render::PointList land;
  const auto node = [&](int column, int row) {
    return at(relief.origin() + relief.cell() * Eigen::Vector2d(column, row),
              relief.node(column, row) - kBelow_m);
  };
  for (int row = 0; row + 1 < relief.rows(); ++row) {
    for (int column = 0; column + 1 < relief.columns(); ++column) {
      const Eigen::Vector3f a = node(column, row), b = node(column + 1, row),
                            c = node(column + 1, row + 1), d = node(column, row + 1);
      if (!std::isfinite(a.z() + b.z() + c.z() + d.z())) continue;
      land.insert(land.end(), {a, b, c, a, c, d});
    }
  }
  return {std::move(land), {}};
}

}  // namespace

bool isFloor(const render::SurfacePatch& surface) {
  const Eigen::Isometry3d& T = surface.T_world_surface.matrix();
  return std::abs(T.translation().z()) < kFloorHeight_m && T.linear()(2, 2) > 0.999;
}

ProjectorConfig roomSolidsConfig(const std::string& fixed_frame) {
  LayerConfig solids;
  solids.topic = "/room/solids";
  solids.type = LayerType::MarkerArray;
  ProjectorConfig config;
  config.fixed_frame = fixed_frame;
  config.layers = {solids};
  return config;
}

std::vector<render::Drawable> solidsOf(const render::Scene& scene) {
  std::vector<render::Drawable> solids;
  for (const render::Layer& layer : scene.layers) {
    solids.insert(solids.end(), layer.drawables.begin(), layer.drawables.end());
  }
  return solids;
}

MeshReader robotMeshes(MeshLibrary& library, std::function<void(const std::string& why)> tell) {
  return [&library, tell = std::move(tell)](const std::string& resource) -> render::SharedBody {
    const MeshLibrary::Mesh mesh = library.get(resource);
    if (mesh.value) return *mesh.value;
    tell(mesh.reason);
    return nullptr;
  };
}

std::vector<render::Drawable> robotSolids(const RobotModel& robot, FrameLookup& frames) {
  LinkPoses T_world_link;
  for (const LinkVisual& visual : robot.visuals()) {
    if (const auto pose = frames.at(visual.link, ros::Time(0))) T_world_link[visual.link] = *pose;
  }
  return robot.drawables(T_world_link);
}

std::vector<render::Drawable> surfaceSolids(const render::Scene& scene,
                                            const Eigen::Vector3d& p_world_middle) {
  std::vector<render::SurfacePatch> surfaces = scene.surfaces;
  for (const render::Layer& layer : scene.layers) {
    const auto same = [&](const auto& known) { return known.name == layer.surface->name; };
    if (layer.surface && std::none_of(surfaces.begin(), surfaces.end(), same)) {
      surfaces.push_back(*layer.surface);
    }
  }
  std::vector<render::Drawable> solids;
  for (const render::SurfacePatch& surface : surfaces) {
    solids.push_back(
        {Rigid<World, World>(surface.T_world_surface.matrix()),
         surface.relief ? landscape(*surface.relief) : slab(outlineOf(surface, p_world_middle)),
         paintOf(surface)});
  }
  return solids;
}

}  // namespace afterglow::nodes
