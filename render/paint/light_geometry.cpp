// Triangles, lines, outlines and points into a LightFrame.
#include <algorithm>
#include <cmath>

#include "render/paint/light_frame.hpp"
#include "render/paint/packed_color.hpp"
#include "render/scene/thin_lines.hpp"

namespace afterglow::render {
namespace {

constexpr std::uint32_t kNoIndex = ~std::uint32_t{0};

/// Any order of drawing shows the same if all have one opaque colour.
bool needsSorting(const std::vector<LightPoint>& points, std::size_t first) {
  const Rgba color = points[first].center.color;
  return !isOpaque(color) ||
         std::any_of(points.begin() + static_cast<std::ptrdiff_t>(first), points.end(),
                     [&](const LightPoint& point) { return point.center.color != color; });
}

}  // namespace

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
                                                packedColor(asBytes(cut_vertices_.front().color)),
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
        &outline_points_[parts[i]], end - parts[i],
        packedColor(asBytes(cut_vertices_[parts[i]].color)), frame_.sprites);
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
