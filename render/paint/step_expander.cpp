#include "render/paint/step_expander.hpp"

#include <algorithm>

#include "render/paint/screen_point.hpp"

namespace afterglow::render {
namespace {

/// Directions and the eye, in the list's own frame.
void setEye(const Eye& eye, const Eigen::Isometry3d& T_world_list, SpriteShape& shape) {
  const Eigen::Isometry3d T_list_world = T_world_list.inverse();
  shape.eye_is_direction = eye.parallel;
  shape.eye = (eye.parallel ? Eigen::Vector3d(T_list_world.linear() * -eye.R_world_eye.col(2))
                            : Eigen::Vector3d(T_list_world * eye.p_world))
                  .cast<float>();
  shape.right = (T_list_world.linear() * eye.R_world_eye.col(0)).cast<float>();
  shape.up = (T_list_world.linear() * eye.R_world_eye.col(1)).cast<float>();
}

/// Indices and pieces of `other` behind what is in `out` already.
void appendTriangles(const LightTriangles& other, LightTriangles& out) {
  const auto first_vertex = static_cast<std::uint32_t>(out.vertices.size());
  out.vertices.insert(out.vertices.end(), other.vertices.begin(), other.vertices.end());
  std::transform(other.indices.begin(), other.indices.end(), std::back_inserter(out.indices),
                 [first_vertex](std::uint32_t i) { return first_vertex + i; });
}

}  // namespace

PointPlacement pointPlacement(const Drawable& drawable, const Placed& placed) {
  const Eigen::Matrix4d T_world_cloud = drawable.pose.matrix().matrix();
  return {placed.P_optical_world * T_world_cloud, T_world_cloud.transpose() * placed.height,
          placed.flattened, placed.gain};
}

void ExpandedSteps::clear() {
  triangles.vertices.clear();
  triangles.indices.clear();
  sprites.clear();
  pieces.clear();
}

void ExpandedSteps::append(const ExpandedSteps& other) {
  const auto first_index = static_cast<std::uint32_t>(triangles.indices.size());
  const auto first_sprite = static_cast<std::uint32_t>(sprites.used);
  appendTriangles(other.triangles, triangles);
  sprites.append(other.sprites);
  for (Piece piece : other.pieces) {
    piece.first += piece.kind == Piece::Kind::Triangles ? first_index : first_sprite;
    pieces.push_back(piece);
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
  setEye(layer.eye, drawable.pose.matrix(), list->shape);
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
