#include "render/paint/cpu_drawer.hpp"

#include <algorithm>

#include "render/paint/screen_point.hpp"

namespace afterglow::render {
namespace {

PointPlacement pointPlacement(const Drawable& drawable, const Placed& placed) {
  const Eigen::Matrix4d T_world_cloud = drawable.pose.matrix().matrix();
  return {placed.P_optical_world * T_world_cloud, T_world_cloud.transpose() * placed.height,
          placed.flattened, placed.gain};
}

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

}  // namespace

CpuDrawer::CpuDrawer(const calib::Lens& lens, int threads)
    : workers_(threads),
      point_projector_(lens),
      sprite_projector_(lens),
      outline_projector_(lens),
      triangle_projector_(lens),
      painter_(lens, workers_) {}

void CpuDrawer::draw(const ComposedImage& composed, Image& image) {
  list_.triangles.begin(composed);
  list_.runs.clear();
  list_.sprites.clear();
  list_.layers.clear();
  screen_point_count_ = 0;
  for (const ComposedLayer& layer : composed.layers) {
    list_.layers.push_back({layer.mask, layer.placed.flattened, {}});
    pieces_ = &list_.layers.back().pieces;
    for (const Drawable* drawable : layer.steps) expand(*drawable, layer);
    sortForDrawing(*pieces_);
  }
  painter_.paint(list_, image.rgb.data());
}

void CpuDrawer::expand(const Drawable& drawable, const ComposedLayer& layer) {
  if (pixelCloud(drawable.shape) != nullptr) return addPoints(drawable, layer);
  if (addSprites(drawable, layer)) return;
  triangle_projector_.place(drawable, layer);
  if (addOutlines(layer)) return;
  if (const auto piece = triangle_projector_.add(list_.triangles)) pieces_->push_back(*piece);
}

void CpuDrawer::addPoints(const Drawable& drawable, const ComposedLayer& layer) {
  const PointRun run = point_projector_.project(
      *pixelCloud(drawable.shape), drawable.color, pointPlacement(drawable, layer.placed),
      workers_, list_.screen_points, screen_point_count_);
  if (run.count == 0) return;
  const auto index = static_cast<std::uint32_t>(list_.runs.size());
  list_.runs.push_back(run);
  pieces_->push_back({Piece::Kind::Points, false, index, 1, run.mean_depth});
}

bool CpuDrawer::addSprites(const Drawable& drawable, const ComposedLayer& layer) {
  if (layer.relief != nullptr) return false;
  auto list = spriteList(drawable.shape);
  if (!list || !drawable.pose.matrix().matrix().allFinite()) return false;
  setEye(layer.eye, drawable.pose.matrix(), list->shape);
  const auto piece = sprite_projector_.project(
      *list, drawable.color, pointPlacement(drawable, layer.placed), workers_, list_.sprites);
  if (piece && piece->count > 0) pieces_->push_back(*piece);
  return piece.has_value();
}

bool CpuDrawer::addOutlines(const ComposedLayer& layer) {
  const TriangleProjector& placed = triangle_projector_;
  if (layer.relief != nullptr || !placed.isWhole()) return false;
  const bool is_flat = isFlat();
  const bool is_small = !placed.tessellation().convex_parts.empty() &&
                        placed.sizePx().maxCoeff() <= double{kLargestBody};
  if (!is_flat && !is_small) return false;
  outline_points_.clear();
  for (const CutVertex& vertex : placed.vertices()) {
    const LightVertex light = lightVertex(vertex, layer.placed);
    outline_points_.push_back({light.x / light.z, light.y / light.z, light.depth});
  }
  const Piece piece =
      is_flat ? outline_projector_.projectEdges(
                    outline_points_, *placed.tessellation().outline,
                    packedColor(asBytes(placed.vertices().front().color)), list_.sprites)
              : hulls();
  if (piece.count > 0) pieces_->push_back(piece);
  return true;
}

bool CpuDrawer::isFlat() const {
  const auto* outline = triangle_projector_.tessellation().outline;
  const std::vector<CutVertex>& vertices = triangle_projector_.vertices();
  return outline != nullptr && std::all_of(outline->begin(), outline->end(), [&](const auto& edge) {
           return triangle_projector_.isStraight(vertices[edge[0]], vertices[edge[1]]);
         });
}

/// The tessellation's convex parts, each of one color.
Piece CpuDrawer::hulls() {
  const std::vector<std::uint32_t>& parts = triangle_projector_.tessellation().convex_parts;
  Piece piece{};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t end = i + 1 < parts.size() ? parts[i + 1] : outline_points_.size();
    const Piece one = outline_projector_.projectHull(
        &outline_points_[parts[i]], end - parts[i],
        packedColor(asBytes(triangle_projector_.vertices()[parts[i]].color)), list_.sprites);
    if (i == 0) piece = one;
    piece.count = static_cast<std::uint32_t>(list_.sprites.used) - piece.first;
    piece.is_opaque = piece.is_opaque && one.is_opaque;
  }
  return piece;
}

}  // namespace afterglow::render
