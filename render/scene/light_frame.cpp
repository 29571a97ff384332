#include "render/scene/light_frame.hpp"

#include <algorithm>
#include <cmath>

#include "render/splat/point_painter.hpp"

namespace afterglow::render {
namespace {

constexpr std::uint32_t kNoIndex = ~std::uint32_t{0};
/// From how many on painting points pays, although their picture has to be laid over GL's.
constexpr std::size_t kManyPoints = 30'000;

Eigen::Vector4f asFloats(const Rgba& color) {
  return Eigen::Vector4f(color.r, color.g, color.b, color.a);
}

Rgba asBytes(const Eigen::Vector4f& color) {
  const auto byte = [](float value) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.f, 255.f)));
  };
  return {byte(color[0]), byte(color[1]), byte(color[2]), byte(color[3])};
}

bool isOpaque(const Rgba& color) { return color.a == 255; }
bool isInvisible(const Rgba& color) { return color.a == 0; }

/// Height over the surface's plane as a row: height = row . (p, 1).
Eigen::Vector4d heightRow(const SurfacePatch& surface) {
  const Eigen::Isometry3d& T = surface.T_world_surface.matrix();
  const Eigen::Vector3d n = T.linear().col(2);
  return {n.x(), n.y(), n.z(), -n.dot(T.translation())};
}

/// Any order of drawing shows the same if all have one opaque colour.
bool needsSorting(const std::vector<LightPoint>& points, std::size_t first) {
  const Rgba color = points[first].center.color;
  return !isOpaque(color) ||
         std::any_of(points.begin() + static_cast<std::ptrdiff_t>(first), points.end(),
                     [&](const LightPoint& point) { return point.center.color != color; });
}

const PointCloud* paintable(const Drawable& drawable) {
  const auto* cloud = std::get_if<PointCloud>(&drawable.shape);
  const bool fits = cloud != nullptr && cloud->style == PointStyle::Points &&
                    cloud->size <= PointPainter::kLargest;
  return fits ? cloud : nullptr;
}

bool isOutlined(const Layer& layer) { return layer.surface && !layer.surface->polygon.empty(); }

/// Whether OpenGL has nothing to do for it.
bool isPaintable(const Layer& layer) {
  return layer.drawables.empty() ||
         (!isOutlined(layer) &&
          std::all_of(layer.drawables.begin(), layer.drawables.end(), paintable));
}

}  // namespace

bool LightFrame::isPaintedOnly() const {
  return std::all_of(layers.begin(), layers.end(), [](const LightLayer& layer) {
    const auto isPainted = [](const LightStep& step) {
      return step.kind == LightStep::Kind::Painted;
    };
    return layer.steps.empty() ||
           (!layer.masked && std::all_of(layer.steps.begin(), layer.steps.end(), isPainted));
  });
}

LightComposer::LightComposer(const calib::Lens& lens)
    : lens_(lens), domain_(lens), cutter_(domain_), point_projector_(lens) {}

const LightFrame& LightComposer::compose(const Scene& scene,
                                         const Rigid<Projector, World>& T_projector_world) {
  frame_.vertices.clear();
  frame_.indices.clear();
  frame_.points.clear();
  frame_.layers.clear();
  frame_.runs.clear();
  screen_point_count_ = 0;
  has_more_than_points_ = !std::all_of(scene.layers.begin(), scene.layers.end(), isPaintable);
  was_flattened_ = has_depths_ = false;
  for (const Layer& layer : scene.layers) addLayer(layer, T_projector_world);
  return frame_;
}

void LightComposer::addLayer(const Layer& layer, const Rigid<Projector, World>& T_projector_world) {
  Placed placed;
  placed.P_optical_world = T_projector_world.matrix().matrix() * placementMatrix(layer);
  placed.flattened = layer.placement != Placement::Direct;
  placed.height = layer.surface ? heightRow(*layer.surface) : Eigen::Vector4d::Zero();
  LightLayer out;
  out.flattened = placed.flattened;
  if (placed.flattened || was_flattened_) has_depths_ = false;
  was_flattened_ = placed.flattened;
  if (isOutlined(layer)) {
    addMask(*layer.surface, T_projector_world, out);
  }
  const Eye eye = eyeOfLayer(layer, T_projector_world);
  const bool painted = isPainted(layer);
  steps_.clear();
  for (const Drawable& drawable : layer.drawables) {
    if (painted) {
      addPainted(drawable, placed);
      continue;
    }
    tessellate(drawable, eye, tessellation_);
    addDrawable(placed);
  }
  addSteps(out);
  has_depths_ =
      has_depths_ || std::any_of(out.steps.begin(), out.steps.end(), [](const auto& step) {
        return step.kind == LightStep::Kind::Opaque || step.kind == LightStep::Kind::Translucent;
      });
  frame_.layers.push_back(std::move(out));
}

bool LightComposer::isPainted(const Layer& layer) const {
  if (workers_ == nullptr || has_depths_) return false;
  std::size_t count = 0;
  for (const Drawable& drawable : layer.drawables) {
    const PointCloud* cloud = paintable(drawable);
    if (cloud == nullptr) return false;
    count += cloud->points.size();
  }
  return !has_more_than_points_ || count >= kManyPoints;
}

void LightComposer::addPainted(const Drawable& drawable, const Placed& placed) {
  const Eigen::Matrix4d T_world_cloud = drawable.pose.matrix().matrix();
  const PointPlacement placement{placed.P_optical_world * T_world_cloud,
                                 T_world_cloud.transpose() * placed.height, placed.flattened};
  const PointRun run =
      point_projector_.project(std::get<PointCloud>(drawable.shape), drawable.color, placement,
                               *workers_, frame_.screen_points, screen_point_count_);
  if (run.count == 0) return;
  const auto index = static_cast<std::uint32_t>(frame_.runs.size());
  frame_.runs.push_back(run);
  steps_.push_back({{LightStep::Kind::Painted, index, 1}, run.mean_depth});
}

/// A fan over the outline: where an odd number of its triangles overlap is inside, whether the
/// outline is convex or not. Edges inside the fan cancel out, however the lens would bend them.
void LightComposer::addMask(const SurfacePatch& surface,
                            const Rigid<Projector, World>& T_projector_world, LightLayer& out) {
  out.masked = true;
  out.mask_first = static_cast<std::uint32_t>(frame_.indices.size());
  cut_vertices_.clear();
  for (const Eigen::Vector2d& corner : surface.polygon) {
    CutVertex vertex;
    const Eigen::Vector3d p_surface(corner.x(), corner.y(), 0);
    vertex.p_optical = (T_projector_world * (surface.T_world_surface * p_surface)).homogeneous();
    vertex.color.setZero();
    cut_vertices_.push_back(vertex);
  }
  const std::vector<CutVertex>& outline = cutter_.cutOutline(cut_vertices_);
  const auto first = static_cast<std::uint32_t>(frame_.vertices.size());
  for (const CutVertex& vertex : outline) addVertex(vertex, Placed{});
  for (std::uint32_t i = 2; i < outline.size(); ++i) {
    frame_.indices.insert(frame_.indices.end(), {first, first + i - 1, first + i});
  }
  out.mask_count = static_cast<std::uint32_t>(frame_.indices.size()) - out.mask_first;
}

void LightComposer::addDrawable(const Placed& placed) {
  const auto meanDepth = [](auto first, auto last, auto depth) {
    double sum = 0;
    for (auto it = first; it != last; ++it) sum += depth(*it);
    return sum / static_cast<double>(std::max<std::ptrdiff_t>(1, last - first));
  };
  const Mesh& mesh = tessellation_.mesh;
  if (!std::all_of(mesh.colors.begin(), mesh.colors.end(), isInvisible)) {
    const auto first = static_cast<std::uint32_t>(frame_.indices.size());
    const auto vertex = static_cast<std::ptrdiff_t>(frame_.vertices.size());
    addMesh(mesh, placed);
    const auto count = static_cast<std::uint32_t>(frame_.indices.size()) - first;
    const bool opaque = std::all_of(mesh.colors.begin(), mesh.colors.end(), isOpaque);
    const LightStep step{opaque ? LightStep::Kind::Opaque : LightStep::Kind::Translucent, first,
                         count};
    const double depth = meanDepth(frame_.vertices.begin() + vertex, frame_.vertices.end(),
                                   [](const LightVertex& v) { return v.depth; });
    if (count > 0) steps_.push_back({step, depth});
  }
  const auto first = static_cast<std::uint32_t>(frame_.points.size());
  addSplats(tessellation_.splats, placed);
  const auto count = static_cast<std::uint32_t>(frame_.points.size()) - first;
  if (count == 0) return;
  const double depth = meanDepth(frame_.points.begin() + first, frame_.points.end(),
                                 [](const LightPoint& p) { return p.center.depth; });
  steps_.push_back({{LightStep::Kind::Points, first, count}, depth});
}

/// Opaque things in any order, in as few runs as possible; then the others, farthest first.
void LightComposer::addSteps(LightLayer& out) {
  std::stable_sort(steps_.begin(), steps_.end(), [](const Sorted& a, const Sorted& b) {
    const bool a_opaque = a.step.kind == LightStep::Kind::Opaque;
    const bool b_opaque = b.step.kind == LightStep::Kind::Opaque;
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

void LightComposer::addMesh(const Mesh& mesh, const Placed& placed) {
  const std::size_t count = mesh.points.size();
  cut_vertices_.resize(count);
  inside_.resize(count);
  index_of_.assign(count, kNoIndex);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector4d p_world = mesh.points[i].homogeneous();
    cut_vertices_[i] = {placed.P_optical_world * p_world, asFloats(mesh.colors[i]),
                        placed.height.dot(p_world)};
    inside_[i] = isInside(domain_, cut_vertices_[i]);
  }
  const auto straight = [&](const CutVertex& a, const CutVertex& b) {
    return domain_.isStraight(normalized(a), normalized(b));
  };
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

void LightComposer::addSplats(const std::vector<Splat>& splats, const Placed& placed) {
  const std::size_t first = frame_.points.size();
  for (const Splat& splat : splats) {
    if (isInvisible(splat.color)) continue;
    const Eigen::Vector4d p_world = splat.p_world.homogeneous();
    CutVertex vertex{placed.P_optical_world * p_world, asFloats(splat.color),
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
  if (first < frame_.points.size() && needsSorting(frame_.points, first)) {
    std::stable_sort(
        frame_.points.begin() + static_cast<std::ptrdiff_t>(first), frame_.points.end(),
        [](const LightPoint& a, const LightPoint& b) { return a.center.depth > b.center.depth; });
  }
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
