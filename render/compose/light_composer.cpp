#include "render/compose/light_composer.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::render {
namespace {

/// Height over the surface's plane as a row: height = row . (p_world, 1).
Eigen::Vector4d heightRow(const SurfacePatch& surface) {
  const Eigen::Isometry3d& T = surface.T_world_surface.matrix();
  const Eigen::Vector3d n = T.linear().col(2);
  return {n.x(), n.y(), n.z(), -n.dot(T.translation())};
}

/// The corners of its polygon, in world coordinates; empty: the surface is endless.
std::vector<Eigen::Vector3d> outlineInWorld(const SurfacePatch& surface) {
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector2d& corner : surface.polygon) {
    corners.push_back(surface.T_world_surface.matrix() *
                      Eigen::Vector3d(corner.x(), corner.y(), 0));
  }
  return corners;
}

/// Returns true if they catch light at the same places of their planes.
bool isSame(const SurfacePatch& a, const SurfacePatch& b) {
  return a.name == b.name && a.polygon == b.polygon &&
         a.T_world_surface.matrix().matrix() == b.T_world_surface.matrix().matrix();
}

/// The part of an outline that lies on the lens's side of the surface's plane: light through it
/// never reaches the surface. World coordinates.
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

}  // namespace

LightComposer::LightComposer(const calib::Lens& lens) : domain_(lens), cutter_(domain_) {}

const ComposedImage& LightComposer::compose(const Scene& scene,
                                            const Rigid<Projector, World>& T_projector_world) {
  scene_ = &scene;
  T_projector_world_ = T_projector_world;
  image_.masks.clear();
  image_.layers.clear();
  masked_.clear();
  laid_.clear();
  for (const Layer& layer : scene.layers) addLayer(layer);
  const auto isUnused = [](const auto& placer) { return placer.use_count() == 1; };
  placers_.erase(std::remove_if(placers_.begin(), placers_.end(), isUnused), placers_.end());
  return image_;
}

void LightComposer::addLayer(const Layer& layer) {
  ComposedLayer out;
  Placed& placed = out.placed;
  placed.P_optical_world = T_projector_world_.matrix().matrix() * placementMatrix(layer);
  placed.flattened = layer.placement != Placement::Direct;
  placed.height = layer.surface ? heightRow(*layer.surface) : Eigen::Vector4d::Zero();
  placed.gain = std::pow(std::max(0.f, layer.gain), 1 / 2.2f);
  out.eye = eyeOfLayer(layer, T_projector_world_, domain_.focal().mean());
  if (layer.surface) out.mask = maskOf(*layer.surface);
  if (placed.flattened && layer.surface->relief) {
    placed.P_optical_world = T_projector_world_.matrix().matrix();
    out.relief = placerFor(layer);
  }
  out.steps.reserve(layer.drawables.size());
  for (const Drawable& drawable : layer.drawables) {
    const bool is_laid_here = out.relief != nullptr && pixelCloud(drawable.shape) != nullptr;
    out.steps.push_back(is_laid_here ? &laid(drawable, *out.relief) : &drawable);
  }
  image_.layers.push_back(std::move(out));
}

std::shared_ptr<const ReliefPlacer> LightComposer::placerFor(const Layer& layer) {
  const Eigen::Vector3d p_lens = T_projector_world_.matrix().inverse().translation();
  const auto known = std::find_if(placers_.begin(), placers_.end(),
                                  [&](const auto& placer) { return placer->isFor(layer, p_lens); });
  if (known != placers_.end()) return *known;
  placers_.push_back(std::make_shared<const ReliefPlacer>(layer, p_lens));
  return placers_.back();
}

/// A cloud's points on the relief, in world coordinates.
const Drawable& LightComposer::laid(const Drawable& drawable, const ReliefPlacer& relief) {
  const PointCloud& cloud = *pixelCloud(drawable.shape);
  PointCloud out;
  out.style = cloud.style;
  out.size = cloud.size;
  PointList points;
  ByteColorList colors;
  const ByteColorList& own_colors = cloud.colors;
  const PointList& own_points = cloud.points;
  for (std::size_t i = 0; i < own_points.size(); ++i) {
    if (!own_points[i].allFinite()) continue;
    const auto spot = relief.place(drawable.pose.matrix() * own_points[i].cast<double>());
    if (!spot) continue;
    points.push_back(spot->cast<float>());
    if (i < own_colors.size()) colors.push_back(own_colors[i]);
  }
  out.points = std::move(points);
  out.colors = std::move(colors);
  laid_.push_back({{}, std::move(out), drawable.color});
  return laid_.back();
}

int LightComposer::maskOf(const SurfacePatch& surface) {
  const auto known = std::find_if(masked_.begin(), masked_.end(), [&](const SurfacePatch* other) {
    return isSame(*other, surface);
  });
  if (known != masked_.end()) return static_cast<int>(known - masked_.begin());
  ComposedMask mask;
  // A relief ends within the outline by itself, at its own height.
  if (!surface.polygon.empty() && !surface.relief) {
    mask.outline = seenOutline(outlineInWorld(surface));
  }
  const Eigen::Vector3d p_lens = T_projector_world_.matrix().inverse().translation();
  for (const SurfacePatch& other : scene_->surfaces) {
    if (other.name == surface.name || other.polygon.empty()) continue;
    const auto before = partBefore(surface, outlineInWorld(other), p_lens);
    if (before.size() < 3) continue;
    SeenOutline shade = seenOutline(before);
    if (shade.size() >= 3) mask.shades.push_back(std::move(shade));
  }
  if (!mask.outline && mask.shades.empty()) return -1;
  masked_.push_back(&surface);
  image_.masks.push_back(std::move(mask));
  return static_cast<int>(masked_.size()) - 1;
}

SeenOutline LightComposer::seenOutline(const std::vector<Eigen::Vector3d>& corners_world) {
  corners_.clear();
  for (const Eigen::Vector3d& p_world : corners_world) {
    CutVertex vertex;
    vertex.p_optical = (T_projector_world_.matrix() * p_world).homogeneous();
    vertex.color.setZero();
    corners_.push_back(vertex);
  }
  SeenOutline seen;
  for (const CutVertex& vertex : cutter_.cutOutline(corners_)) {
    seen.push_back(vertex.p_optical.hnormalized());
  }
  return seen;
}

}  // namespace afterglow::render
