#include "render/scene/light_frame.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "render/paint/sprite_list.hpp"
#include "render/scene/surface_outline.hpp"
#include "render/scene/thin_lines.hpp"

namespace afterglow::render {
namespace {

constexpr std::uint32_t kNoIndex = ~std::uint32_t{0};

Eigen::Vector4f asFloats(const Rgba& color, float gain) {
  return Eigen::Vector4f(gain * color.r, gain * color.g, gain * color.b, color.a);
}

Rgba asBytes(const Eigen::Vector4f& color) {
  const auto byte = [](float value) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.f, 255.f)));
  };
  return {byte(color[0]), byte(color[1]), byte(color[2]), byte(color[3])};
}

std::uint32_t bitsOf(const Rgba& color) {
  std::uint32_t bits;
  std::memcpy(&bits, &color, sizeof(bits));
  return bits;
}

bool isOpaque(const Rgba& color) { return color.a == 255; }
bool isInvisible(const Rgba& color) { return color.a == 0; }

/// Any order of drawing shows the same if all have one opaque colour.
bool needsSorting(const std::vector<LightPoint>& points, std::size_t first) {
  const Rgba color = points[first].center.color;
  return !isOpaque(color) ||
         std::any_of(points.begin() + static_cast<std::ptrdiff_t>(first), points.end(),
                     [&](const LightPoint& point) { return point.center.color != color; });
}

}  // namespace

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

/// On a relief it is laid piece by piece.
void LightComposer::addThin(const ThinLine& line, const Placed& placed) {
  const double cell = placer_ != nullptr ? placer_->cell() : 0;
  const double length = (line.to - line.from).norm();
  const int pieces = cell > 0 ? static_cast<int>(std::min(std::ceil(length / cell), 1e4)) : 1;
  const auto at = [&](int i) -> std::optional<CutVertex> {
    const double share = static_cast<double>(i) / pieces;
    const Eigen::Vector3d content = line.from + share * (line.to - line.from);
    const auto p = placer_ != nullptr ? placer_->place(content) : std::optional(content);
    if (!p) return std::nullopt;
    const auto weight = static_cast<float>(share);
    return CutVertex{placed.P_optical_world * p->homogeneous(),
                     (1 - weight) * asFloats(line.from_color, placed.gain) +
                         weight * asFloats(line.to_color, placed.gain),
                     placed.height.dot(content.homogeneous())};
  };
  thin_.clear();
  auto from = at(0);
  for (int i = 1; i <= pieces; ++i) {
    auto to = at(i);
    if (from && to) addThinLine(domain_, *from, *to, line.width_px, thin_);
    from = to;
  }
  for (std::size_t i = 0; i < thin_.size(); i += 3) {
    for (const CutVertex& vertex : cutter_.cut(thin_[i], thin_[i + 1], thin_[i + 2])) {
      frame_.indices.push_back(addVertex(vertex, placed));
    }
  }
}

void LightComposer::addTriangles(const Mesh& mesh, const Placed& placed) {
  const std::size_t count = mesh.points.size();
  cut_vertices_.resize(count);
  inside_.resize(count);
  index_of_.assign(count, kNoIndex);
  Eigen::AlignedBox2d seen;
  unsigned beyond_all = ~0u;
  bool all_inside = true;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector4d p_world = mesh.points[i].homogeneous();
    CutVertex& vertex = cut_vertices_[i];
    vertex = {placed.P_optical_world * p_world, asFloats(mesh.colors[i], placed.gain),
              placer_ != nullptr ? laid_.heights[i] : placed.height.dot(p_world)};
    inside_[i] = isInside(domain_, vertex);
    all_inside = all_inside && inside_[i];
    if (inside_[i]) seen.extend(normalized(vertex));
    if (beyond_all != 0) beyond_all &= inside_[i] ? 0 : bordersBeyond(domain_, vertex);
  }
  if (beyond_all != 0) return;
  // Most things are so small that none of their edges can be bent.
  const bool is_small = all_inside && domain_.isStraightWithin(seen.min(), seen.max());
  const auto straight = [&](const CutVertex& a, const CutVertex& b) {
    return is_small || domain_.isStraight(normalized(a), normalized(b));
  };
  if (isForPainter() && placer_ == nullptr && all_inside) {
    const auto* outline = tessellation_.outline;
    if (outline != nullptr && std::all_of(outline->begin(), outline->end(), [&](const auto& edge) {
          return straight(cut_vertices_[edge[0]], cut_vertices_[edge[1]]);
        })) {
      return addFlat(placed);
    }
    const Eigen::Vector2d size_px = seen.sizes().cwiseProduct(domain_.focal());
    if (!tessellation_.convex_parts.empty() && size_px.maxCoeff() <= double{kLargestBody}) {
      return addHulls(placed);
    }
  }
  for (const auto& t : mesh.triangles) {
    const CutVertex &a = cut_vertices_[t[0]], &b = cut_vertices_[t[1]], &c = cut_vertices_[t[2]];
    if (inside_[t[0]] && inside_[t[1]] && inside_[t[2]] && straight(a, b) && straight(b, c) &&
        straight(c, a)) {
      for (const std::uint32_t i : t) {
        if (index_of_[i] == kNoIndex) index_of_[i] = addVertex(cut_vertices_[i], placed);
        frame_.indices.push_back(index_of_[i]);
      }
      continue;
    }
    for (const CutVertex& vertex : cutter_.cut(a, b, c)) {
      frame_.indices.push_back(addVertex(vertex, placed));
    }
  }
}

void LightComposer::findOutlinePoints(const Placed& placed) {
  outline_points_.clear();
  for (const CutVertex& vertex : cut_vertices_) {
    const LightVertex light = lightVertex(vertex, placed);
    outline_points_.push_back({light.x / light.z, light.y / light.z, light.depth});
  }
}

/// The tessellation's outline, of its cut vertices.
void LightComposer::addFlat(const Placed& placed) {
  findOutlinePoints(placed);
  addSpriteRun(sprite_projector_.projectOutline(outline_points_, *tessellation_.outline,
                                                bitsOf(asBytes(cut_vertices_.front().color)),
                                                frame_.sprites));
}

/// The tessellation's convex parts, each of one color.
void LightComposer::addHulls(const Placed& placed) {
  findOutlinePoints(placed);
  const std::vector<std::uint32_t>& parts = tessellation_.convex_parts;
  SpriteRun run;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t end = i + 1 < parts.size() ? parts[i + 1] : outline_points_.size();
    const SpriteRun one = sprite_projector_.projectHull(
        &outline_points_[parts[i]], end - parts[i], bitsOf(asBytes(cut_vertices_[parts[i]].color)),
        frame_.sprites);
    if (i == 0) run = one;
    run.count = static_cast<std::uint32_t>(frame_.sprites.used) - run.first;
    run.is_opaque = run.is_opaque && one.is_opaque;
  }
  addSpriteRun(run);
}

void LightComposer::addSpriteRun(const SpriteRun& run) {
  if (run.count == 0) return;
  const auto index = static_cast<std::uint32_t>(frame_.sprite_runs.size());
  frame_.sprite_runs.push_back(run);
  steps_.push_back({{LightStep::Kind::Sprites, index, 1}, run.mean_depth});
}

void LightComposer::addSplats(const Placed& placed) {
  const std::size_t first = frame_.points.size();
  for (const Splat& splat : tessellation_.splats) {
    if (isInvisible(splat.color)) continue;
    const Eigen::Vector4d p_world = splat.p_world.homogeneous();
    CutVertex vertex{placed.P_optical_world * p_world, asFloats(splat.color, placed.gain),
                     placed.height.dot(p_world)};
    if (!(vertex.p_optical.w() > 0)) continue;
    vertex.p_optical /= vertex.p_optical.w();
    if (!(vertex.p_optical.z() >= LensDomain::kNear)) continue;
    const auto pixel = calib::project(lens_, vertex.p_optical.head<3>());
    if (!pixel || (pixel->array() < -kPointMargin).any() ||
        pixel->x() > lens_.width + kPointMargin || pixel->y() > lens_.height + kPointMargin) {
      continue;
    }
    frame_.points.push_back({lightVertex(vertex, placed), splat.size_px});
  }
  const std::size_t count = frame_.points.size() - first;
  if (count == 0) return;
  const auto begin = frame_.points.begin() + static_cast<std::ptrdiff_t>(first);
  if (needsSorting(frame_.points, first)) {
    std::stable_sort(begin, frame_.points.end(), [](const LightPoint& a, const LightPoint& b) {
      return a.center.depth > b.center.depth;
    });
  }
  double depth = 0;
  for (auto it = begin; it != frame_.points.end(); ++it) {
    depth += static_cast<double>(it->center.depth);
  }
  steps_.push_back({{LightStep::Kind::Points, static_cast<std::uint32_t>(first),
                     static_cast<std::uint32_t>(count)},
                    depth / static_cast<double>(count)});
}

LightVertex LightComposer::lightVertex(const CutVertex& vertex, const Placed& placed) const {
  const Eigen::Vector4d p = vertex.p_optical / vertex.p_optical.w();
  const double depth = placed.flattened ? -vertex.height / (1 + std::abs(vertex.height))
                                        : 1 - 2 * LensDomain::kNear / p.z();
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()),
          static_cast<float>(depth), asBytes(vertex.color)};
}

std::uint32_t LightComposer::addVertex(const CutVertex& vertex, const Placed& placed) {
  frame_.vertices.push_back(lightVertex(vertex, placed));
  return static_cast<std::uint32_t>(frame_.vertices.size() - 1);
}

}  // namespace afterglow::render
