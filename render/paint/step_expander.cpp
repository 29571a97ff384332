#include "render/paint/step_expander.hpp"

#include <algorithm>

#include "render/paint/screen_point.hpp"

namespace afterglow::render {

void StepEnds::operator+=(const StepEnds& other) {
  vertices += other.vertices;
  indices += other.indices;
  sprites += other.sprites;
  corners += other.corners;
  pieces += other.pieces;
}

void ExpandedSteps::clear() {
  triangles.vertices.clear();
  triangles.indices.clear();
  sprites.clear();
  pieces.clear();
}

StepEnds ExpandedSteps::ends() const {
  return {triangles.vertices.size(), triangles.indices.size(), sprites.used, sprites.used_corners,
          pieces.size()};
}

void ExpandedSteps::append(const ExpandedSteps& other, const StepEnds& from, const StepEnds& to) {
  const StepEnds here = ends();
  const auto copy = [](const auto& source, std::size_t begin, std::size_t end, auto& out) {
    const auto first = source.begin();
    out.insert(out.end(), first + static_cast<std::ptrdiff_t>(begin),
               first + static_cast<std::ptrdiff_t>(end));
  };
  copy(other.triangles.vertices, from.vertices, to.vertices, triangles.vertices);
  copy(other.triangles.indices, from.indices, to.indices, triangles.indices);
  for (std::size_t i = here.indices; i < triangles.indices.size(); ++i) {
    triangles.indices[i] += static_cast<std::uint32_t>(here.vertices - from.vertices);
  }
  sprites.append(other.sprites, from.sprites, to.sprites, from.corners, to.corners);
  copy(other.pieces, from.pieces, to.pieces, pieces);
  for (std::size_t i = here.pieces; i < pieces.size(); ++i) {
    const bool is_of_triangles = pieces[i].kind == Piece::Kind::Triangles;
    pieces[i].first += static_cast<std::uint32_t>(is_of_triangles ? here.indices - from.indices
                                                                  : here.sprites - from.sprites);
  }
}

void StepExpander::expand(const Drawable& drawable, const ComposedLayer& layer, Workers& workers,
                          ExpandedSteps& out) {
  if (addSprites(drawable, layer, workers, out) || addLetters(drawable, layer, out)) return;
  triangle_projector_.place(drawable, layer);
  if (addHulls(layer, out)) return;
  if (const auto piece = triangle_projector_.add(out.triangles)) out.pieces.push_back(*piece);
}

bool StepExpander::addSprites(const Drawable& drawable, const ComposedLayer& layer,
                              Workers& workers, ExpandedSteps& out) const {
  if (layer.relief != nullptr) return false;
  auto list = spriteList(drawable.shape);
  if (!list || !drawable.pose.matrix().matrix().allFinite()) return false;
  list->shape.turnTo(layer.eye, drawable.pose.matrix());
  const auto piece = sprite_projector_.project(
      *list, drawable.color, pointPlacement(drawable, layer.placed), workers, out.sprites);
  if (piece && piece->count > 0) out.pieces.push_back(*piece);
  return piece.has_value();
}

bool StepExpander::addLetters(const Drawable& drawable, const ComposedLayer& layer,
                              ExpandedSteps& out) {
  const auto* text = std::get_if<Text>(&drawable.shape);
  if (text == nullptr || layer.relief != nullptr) return false;
  if (text->letters == nullptr || !drawable.pose.matrix().matrix().allFinite()) return true;
  const auto piece = letter_projector_.project(*text->letters, drawable, layer, out.sprites);
  if (piece && piece->count > 0) out.pieces.push_back(*piece);
  return piece.has_value();
}

/// The tessellation's convex parts, each of one color.
bool StepExpander::addHulls(const ComposedLayer& layer, ExpandedSteps& out) {
  const TriangleProjector& placed = triangle_projector_;
  const std::vector<std::uint32_t>& parts = placed.tessellation().convex_parts;
  const bool is_small = layer.relief == nullptr && !parts.empty() && placed.isWhole() &&
                        placed.sizePx().maxCoeff() <= double{kLargestBody};
  if (!is_small) return false;
  outline_points_.clear();
  for (const CutVertex& vertex : placed.vertices()) {
    const LightVertex light = lightVertex(vertex, layer.placed);
    outline_points_.push_back({light.x / light.z, light.y / light.z, light.depth});
  }
  Piece piece{};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t end = i + 1 < parts.size() ? parts[i + 1] : outline_points_.size();
    const Piece one = outline_projector_.projectHull(
        &outline_points_[parts[i]], end - parts[i],
        packedColor(asBytes(placed.vertices()[parts[i]].color)), out.sprites);
    if (i == 0) piece = one;
    piece.count = static_cast<std::uint32_t>(out.sprites.used) - piece.first;
    piece.is_opaque = piece.is_opaque && one.is_opaque;
  }
  if (piece.count > 0) out.pieces.push_back(piece);
  return true;
}

}  // namespace afterglow::render
