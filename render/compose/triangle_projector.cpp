#include "render/compose/triangle_projector.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::render {
namespace {

constexpr std::uint32_t kNoIndex = ~std::uint32_t{0};

/// A fan over the outline: where an odd number of its triangles overlap is inside, whether the
/// outline is convex or not. Edges inside the fan cancel out, however the lens would bend them.
LightOutline addFan(const SeenOutline& outline, LightTriangles& out) {
  LightOutline added;
  added.first = static_cast<std::uint32_t>(out.indices.size());
  const auto first = static_cast<std::uint32_t>(out.vertices.size());
  for (const Eigen::Vector3d& p : outline) {
    out.vertices.push_back(lightVertex({p.homogeneous(), Eigen::Vector4f::Zero()}, {}));
  }
  for (std::uint32_t i = 2; i < outline.size(); ++i) {
    out.indices.insert(out.indices.end(), {first, first + i - 1, first + i});
  }
  added.count = static_cast<std::uint32_t>(out.indices.size()) - added.first;
  return added;
}

/// Cuts the part behind the lens off the end at `to`.
bool clipEnd(const CutVertex& from, CutVertex& to) {
  const auto distance = [](const CutVertex& v) {
    return v.p_optical.z() - LensDomain::kNear * v.p_optical.w();
  };
  const double at_from = distance(from), at_to = distance(to);
  if (at_to >= 0) return true;
  if (at_from < 0) return false;
  to = mixed(from, to, at_from / (at_from - at_to));
  return true;
}

CutVertex moved(const CutVertex& vertex, const Eigen::Vector2d& by) {
  CutVertex out = vertex;
  out.p_optical.head<2>() += by * vertex.p_optical.z();
  return out;
}

void addPiece(const LensDomain& domain, const CutVertex& from, const CutVertex& to, double width_px,
              int depth, std::vector<CutVertex>& out) {
  constexpr int kMostHalvings = 12;
  const Eigen::Vector2d a = normalized(from), b = normalized(to);
  if (depth < kMostHalvings && !domain.isStraight(a, b)) {
    const double za = from.p_optical.z(), zb = to.p_optical.z();
    const CutVertex middle = mixed(from, to, za / (za + zb));  // half-way on the image
    addPiece(domain, from, middle, width_px, depth + 1, out);
    addPiece(domain, middle, to, width_px, depth + 1, out);
    return;
  }
  Eigen::Vector2d along = (b - a).cwiseProduct(domain.focal());
  along = along.norm() > 1e-9 ? along.normalized() : Eigen::Vector2d::UnitX();
  const Eigen::Vector2d half = (0.5 * width_px * along).cwiseQuotient(domain.focal());
  const Eigen::Vector2d side =
      (0.5 * width_px * Eigen::Vector2d(-along.y(), along.x())).cwiseQuotient(domain.focal());
  const CutVertex corners[] = {moved(from, -half - side), moved(to, half - side),
                               moved(to, half + side), moved(from, -half + side)};
  for (const int i : {0, 1, 2, 0, 2, 3}) out.push_back(corners[i]);
}

/// A line as a ribbon that the lens shows so many pixels wide all along, half a width longer at
/// both ends so that it meets its neighbors. Appends triangles, three vertices each, w = 1, which
/// may reach out of the domain.
void addBand(const LensDomain& domain, const CutVertex& from, const CutVertex& to, double width_px,
             std::vector<CutVertex>& out) {
  CutVertex a = from, b = to;
  if (!(a.p_optical.w() > 0 && b.p_optical.w() > 0)) return;  // seen along the surface
  if (!clipEnd(a, b) || !clipEnd(b, a)) return;
  a.p_optical /= a.p_optical.w();
  b.p_optical /= b.p_optical.w();
  addPiece(domain, a, b, width_px, 0, out);
}

}  // namespace

LightVertex lightVertex(const CutVertex& vertex, const Placed& placed) {
  const Eigen::Vector4d p = vertex.p_optical / vertex.p_optical.w();
  const double depth = placed.flattened ? -vertex.height / (1 + std::abs(vertex.height))
                                        : 1 - 2 * LensDomain::kNear / p.z();
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()),
          static_cast<float>(depth), asBytes(vertex.color)};
}

void LightTriangles::begin(const ComposedImage& image) {
  vertices.clear();
  indices.clear();
  masks.clear();
  for (const ComposedMask& composed : image.masks) {
    LightMask mask;
    if (composed.outline) mask.outline = addFan(*composed.outline, *this);
    for (const SeenOutline& shade : composed.shades) mask.shades.push_back(addFan(shade, *this));
    masks.push_back(std::move(mask));
  }
}

void TriangleProjector::place(const Drawable& drawable, const ComposedLayer& layer) {
  layer_ = &layer;
  tessellate(drawable, layer.eye, tessellation_);
  mesh_ = &tessellation_.mesh;
  vertices_.clear();
  is_whole_ = false;
  if (std::all_of(mesh_->colors.begin(), mesh_->colors.end(), isInvisible)) return;
  if (layer.relief != nullptr) {
    layer.relief->lay(*mesh_, laid_);
    mesh_ = &laid_.mesh;
  }
  placeVertices(*mesh_);
}

void TriangleProjector::placeVertices(const Mesh& mesh) {
  const std::size_t count = mesh.points.size();
  const Placed& placed = layer_->placed;
  vertices_.resize(count);
  inside_.resize(count);
  seen_.setEmpty();
  unsigned beyond_all = ~0u;
  is_whole_ = true;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector4d p_world = mesh.points[i].homogeneous();
    CutVertex& vertex = vertices_[i];
    vertex = {placed.P_optical_world.lazyProduct(p_world), asFloats(mesh.colors[i], placed.gain),
              layer_->relief != nullptr ? laid_.heights[i] : placed.height.dot(p_world)};
    inside_[i] = isInside(domain_, vertex) ? 1 : 0;
    is_whole_ = is_whole_ && inside_[i];
    if (inside_[i]) seen_.extend(normalized(vertex));
    if (beyond_all != 0) beyond_all &= inside_[i] ? 0 : bordersBeyond(domain_, vertex);
  }
  if (beyond_all != 0) {
    vertices_.clear();
    is_whole_ = false;
    return;
  }
  // Most things are so small that none of their edges can be bent.
  is_small_ = is_whole_ && domain_.isStraightWithin(seen_.min(), seen_.max());
}

bool TriangleProjector::isStraight(const CutVertex& a, const CutVertex& b) const {
  return is_small_ || domain_.isStraight(normalized(a), normalized(b));
}

std::optional<Piece> TriangleProjector::add(LightTriangles& out) {
  const auto first = static_cast<std::uint32_t>(out.indices.size());
  const std::size_t first_vertex = out.vertices.size();
  if (!vertices_.empty()) addMesh(out);
  for (const ThinLine& line : tessellation_.thin_lines) addThinLine(line, out);
  const auto count = static_cast<std::uint32_t>(out.indices.size()) - first;
  if (count == 0) return std::nullopt;
  double depth = 0;
  bool is_opaque = true;
  for (std::size_t i = first_vertex; i < out.vertices.size(); ++i) {
    depth += static_cast<double>(out.vertices[i].depth);
    is_opaque = is_opaque && isOpaque(out.vertices[i].color);
  }
  return Piece{Piece::Kind::Triangles, is_opaque, first, count,
               depth / static_cast<double>(out.vertices.size() - first_vertex)};
}

void TriangleProjector::addMesh(LightTriangles& out) {
  index_of_.assign(vertices_.size(), kNoIndex);
  for (const auto& t : mesh_->triangles) {
    const CutVertex &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
    const bool is_inside = inside_[t[0]] && inside_[t[1]] && inside_[t[2]];
    if (!is_inside || !isStraight(a, b) || !isStraight(b, c) || !isStraight(c, a)) {
      addCut(a, b, c, out);
      continue;
    }
    for (const std::uint32_t i : t) {
      if (index_of_[i] == kNoIndex) index_of_[i] = addVertex(vertices_[i], out);
      out.indices.push_back(index_of_[i]);
    }
  }
}

/// Adds a thin line; a relief has it laid piece by piece.
void TriangleProjector::addThinLine(const ThinLine& line, LightTriangles& out) {
  const Placed& placed = layer_->placed;
  const ReliefPlacer* relief = layer_->relief.get();
  const double length = (line.to - line.from).norm();
  const int pieces =
      relief != nullptr ? static_cast<int>(std::min(std::ceil(length / relief->cell()), 1e4)) : 1;
  const auto at = [&](int i) -> std::optional<CutVertex> {
    const double share = static_cast<double>(i) / pieces;
    const Eigen::Vector3d content = line.from + share * (line.to - line.from);
    const auto p = relief != nullptr ? relief->place(content) : std::optional(content);
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
    if (from && to) addBand(domain_, *from, *to, line.width_px, thin_);
    from = to;
  }
  for (std::size_t i = 0; i < thin_.size(); i += 3) {
    addCut(thin_[i], thin_[i + 1], thin_[i + 2], out);
  }
}

void TriangleProjector::addCut(const CutVertex& a, const CutVertex& b, const CutVertex& c,
                               LightTriangles& out) {
  for (const CutVertex& vertex : cutter_.cut(a, b, c)) {
    out.indices.push_back(addVertex(vertex, out));
  }
}

std::uint32_t TriangleProjector::addVertex(const CutVertex& vertex, LightTriangles& out) const {
  out.vertices.push_back(lightVertex(vertex, layer_->placed));
  return static_cast<std::uint32_t>(out.vertices.size() - 1);
}

}  // namespace afterglow::render
