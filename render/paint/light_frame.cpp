#include "render/paint/light_frame.hpp"

#include <algorithm>
#include <cmath>

#include "render/paint/sprite_list.hpp"
#include "render/scene/surface_outline.hpp"

namespace afterglow::render {

LightComposer::LightComposer(const calib::Lens& lens)
    : lens_(lens),
      domain_(lens),
      cutter_(domain_),
      point_projector_(lens),
      sprite_projector_(lens) {}

const LightFrame& LightComposer::compose(const Scene& scene,
                                         const Rigid<Projector, World>& T_projector_world) {
  frame_.vertices.clear();
  frame_.indices.clear();
  frame_.points.clear();
  frame_.masks.clear();
  frame_.layers.clear();
  frame_.runs.clear();
  frame_.sprites.clear();
  frame_.sprite_runs.clear();
  masked_.clear();
  screen_point_count_ = 0;
  for (const Layer& layer : scene.layers) addLayer(layer, scene, T_projector_world);
  return frame_;
}

void LightComposer::addLayer(const Layer& layer, const Scene& scene,
                             const Rigid<Projector, World>& T_projector_world) {
  Placed placed;
  placed.P_optical_world = T_projector_world.matrix().matrix() * placementMatrix(layer);
  placed.flattened = layer.placement != Placement::Direct;
  placed.height = layer.surface ? heightRow(*layer.surface) : Eigen::Vector4d::Zero();
  placed.gain = std::pow(std::max(0.f, layer.gain), 1 / 2.2f);
  LightLayer out;
  out.flattened = placed.flattened;
  if (layer.surface) out.mask = maskOf(*layer.surface, scene, T_projector_world);
  placer_ = nullptr;
  if (placed.flattened && layer.surface->relief) {
    placed.P_optical_world = T_projector_world.matrix().matrix();
    relief_placer_.begin(layer, T_projector_world.matrix().inverse().translation());
    placer_ = &relief_placer_;
  }
  const Eye eye = eyeOfLayer(layer, T_projector_world, domain_.focal().mean());
  steps_.clear();
  for (const Drawable& drawable : layer.drawables) {
    const auto* cloud = std::get_if<PointCloud>(&drawable.shape);
    if (cloud != nullptr && cloud->style == PointStyle::Points) {
      addPoints(placer_ != nullptr ? laid(drawable, *cloud) : drawable, placed);
    } else if (!addSprites(drawable, eye, placed)) {
      tessellate(drawable, eye, tessellation_);
      addMesh(placed);
    }
  }
  addSteps(out);
  frame_.layers.push_back(std::move(out));
}

/// A cloud's points on the relief, in world coordinates.
Drawable LightComposer::laid(const Drawable& drawable, const PointCloud& cloud) const {
  PointCloud out;
  out.style = cloud.style;
  out.size = cloud.size;
  PointList points;
  ColorList colors;
  const ColorList& own_colors = cloud.colors;
  const PointList& own_points = cloud.points;
  for (std::size_t i = 0; i < own_points.size(); ++i) {
    if (!own_points[i].allFinite()) continue;
    const auto spot = placer_->place(drawable.pose.matrix() * own_points[i].cast<double>());
    if (!spot) continue;
    points.push_back(spot->cast<float>());
    if (i < own_colors.size()) colors.push_back(own_colors[i]);
  }
  out.points = std::move(points);
  out.colors = std::move(colors);
  return {{}, std::move(out), drawable.color};
}

void LightComposer::addPoints(const Drawable& drawable, const Placed& placed) {
  if (isForPainter()) {
    addRun(drawable, placed);
  } else {
    tessellate(drawable, {}, tessellation_);
    addSplats(placed);
  }
}

void LightComposer::addRun(const Drawable& drawable, const Placed& placed) {
  const PointPlacement placement = pointPlacement(drawable, placed);
  const PointRun run =
      point_projector_.project(std::get<PointCloud>(drawable.shape), drawable.color, placement,
                               *workers_, frame_.screen_points, screen_point_count_);
  if (run.count == 0) return;
  const auto index = static_cast<std::uint32_t>(frame_.runs.size());
  frame_.runs.push_back(run);
  steps_.push_back({{LightStep::Kind::Run, index, 1}, run.mean_depth});
}

PointPlacement LightComposer::pointPlacement(const Drawable& drawable, const Placed& placed) {
  const Eigen::Matrix4d T_world_cloud = drawable.pose.matrix().matrix();
  return {placed.P_optical_world * T_world_cloud, T_world_cloud.transpose() * placed.height,
          placed.flattened, placed.gain};
}

bool LightComposer::addSprites(const Drawable& drawable, const Eye& eye, const Placed& placed) {
  if (!isForPainter() || placer_ != nullptr) return false;
  const auto list = spriteList(drawable.shape);
  if (!list || !drawable.pose.matrix().matrix().allFinite()) return false;
  SpriteShape shape = list->shape;
  const Eigen::Isometry3d T_list_world = drawable.pose.matrix().inverse();
  shape.eye_is_direction = eye.parallel;
  shape.eye = (eye.parallel ? Eigen::Vector3d(T_list_world.linear() * -eye.R_world_eye.col(2))
                            : Eigen::Vector3d(T_list_world * eye.p_world))
                  .cast<float>();
  shape.right = (T_list_world.linear() * eye.R_world_eye.col(0)).cast<float>();
  shape.up = (T_list_world.linear() * eye.R_world_eye.col(1)).cast<float>();
  const auto run =
      sprite_projector_.project(*list->points, *list->colors, drawable.color, shape,
                                pointPlacement(drawable, placed), *workers_, frame_.sprites);
  if (!run) return false;
  addSpriteRun(*run);
  return true;
}

int LightComposer::maskOf(const SurfacePatch& surface, const Scene& scene,
                          const Rigid<Projector, World>& T_projector_world) {
  const auto known = std::find_if(masked_.begin(), masked_.end(), [&](const SurfacePatch* other) {
    return isSame(*other, surface);
  });
  if (known != masked_.end()) return static_cast<int>(known - masked_.begin());
  LightMask mask;
  // A relief ends within the outline by itself, at its own height.
  if (!surface.polygon.empty() && !surface.relief) {
    mask.outline = addOutline(outlineInWorld(surface), T_projector_world);
  }
  const Eigen::Vector3d p_lens = T_projector_world.matrix().inverse().translation();
  for (const SurfacePatch& other : scene.surfaces) {
    if (other.name == surface.name || other.polygon.empty()) continue;
    const auto before = partBefore(surface, outlineInWorld(other), p_lens);
    if (before.size() < 3) continue;
    const LightOutline shade = addOutline(before, T_projector_world);
    if (shade.count > 0) mask.shades.push_back(shade);
  }
  if (!mask.outline && mask.shades.empty()) return -1;
  masked_.push_back(&surface);
  frame_.masks.push_back(std::move(mask));
  return static_cast<int>(masked_.size()) - 1;
}

/// A fan over the outline: where an odd number of its triangles overlap is inside, whether the
/// outline is convex or not. Edges inside the fan cancel out, however the lens would bend them.
LightOutline LightComposer::addOutline(const std::vector<Eigen::Vector3d>& corners_world,
                                       const Rigid<Projector, World>& T_projector_world) {
  LightOutline added;
  added.first = static_cast<std::uint32_t>(frame_.indices.size());
  cut_vertices_.clear();
  for (const Eigen::Vector3d& p_world : corners_world) {
    CutVertex vertex;
    vertex.p_optical = (T_projector_world.matrix() * p_world).homogeneous();
    vertex.color.setZero();
    cut_vertices_.push_back(vertex);
  }
  const std::vector<CutVertex>& outline = cutter_.cutOutline(cut_vertices_);
  const auto first = static_cast<std::uint32_t>(frame_.vertices.size());
  for (const CutVertex& vertex : outline) addVertex(vertex, Placed{});
  for (std::uint32_t i = 2; i < outline.size(); ++i) {
    frame_.indices.insert(frame_.indices.end(), {first, first + i - 1, first + i});
  }
  added.count = static_cast<std::uint32_t>(frame_.indices.size()) - added.first;
  return added;
}

/// Triangles and thin lines: one step.
void LightComposer::addMesh(const Placed& placed) {
  const auto first = static_cast<std::uint32_t>(frame_.indices.size());
  const std::size_t vertex = frame_.vertices.size();
  const Mesh* mesh = &tessellation_.mesh;
  const bool is_seen = !std::all_of(mesh->colors.begin(), mesh->colors.end(), isInvisible);
  if (is_seen && placer_ != nullptr) {
    placer_->lay(*mesh, laid_);
    mesh = &laid_.mesh;
  }
  if (is_seen) addTriangles(*mesh, placed);
  for (const ThinLine& line : tessellation_.thin_lines) addThin(line, placed);
  const auto count = static_cast<std::uint32_t>(frame_.indices.size()) - first;
  if (count == 0) return;
  double depth = 0;
  for (std::size_t i = vertex; i < frame_.vertices.size(); ++i) {
    depth += static_cast<double>(frame_.vertices[i].depth);
  }
  const bool opaque =
      std::all_of(frame_.vertices.begin() + static_cast<std::ptrdiff_t>(vertex),
                  frame_.vertices.end(), [](const LightVertex& v) { return isOpaque(v.color); });
  const auto kind = opaque ? LightStep::Kind::Opaque : LightStep::Kind::Translucent;
  steps_.push_back(
      {{kind, first, count}, depth / static_cast<double>(frame_.vertices.size() - vertex)});
}

bool LightComposer::isOpaqueStep(const LightStep& step) const {
  return step.kind == LightStep::Kind::Opaque ||
         (step.kind == LightStep::Kind::Sprites && frame_.sprite_runs[step.first].is_opaque);
}

/// Opaque things in any order, in as few runs as possible; then the others, farthest first.
void LightComposer::addSteps(LightLayer& out) {
  std::stable_sort(steps_.begin(), steps_.end(), [&](const Sorted& a, const Sorted& b) {
    const bool a_opaque = isOpaqueStep(a.step), b_opaque = isOpaqueStep(b.step);
    if (a_opaque || b_opaque) return a_opaque && !b_opaque;
    return a.depth > b.depth;
  });
  for (const Sorted& sorted : steps_) {
    const LightStep& step = sorted.step;
    const bool joins = !out.steps.empty() && step.kind == LightStep::Kind::Opaque &&
                       out.steps.back().kind == LightStep::Kind::Opaque &&
                       out.steps.back().first + out.steps.back().count == step.first;
    if (joins) {
      out.steps.back().count += step.count;
    } else {
      out.steps.push_back(step);
    }
  }
}

}  // namespace afterglow::render
