#include "render/paint/sprite_list.hpp"

namespace afterglow::render {

std::optional<SpriteList> spriteList(const Shape& shape) {
  using Kind = SpriteShape::Kind;
  if (const auto* list = std::get_if<ShapeList>(&shape)) {
    const Kind kind = list->kind == ShapeList::Kind::Cubes ? Kind::Box : Kind::Ball;
    return SpriteList{&list->points, &list->colors, {kind, 0.5f * list->size}};
  }
  const auto* cloud = std::get_if<PointCloud>(&shape);
  if (cloud == nullptr || cloud->style == PointStyle::Points) return std::nullopt;
  const PointList& points = cloud->points;
  const ColorList& colors = cloud->colors;
  const bool is_square =
      cloud->style == PointStyle::Squares || cloud->style == PointStyle::FlatSquares;
  const Kind kind = is_square                           ? Kind::Square
                    : cloud->style == PointStyle::Boxes ? Kind::Box
                                                        : Kind::Ball;
  const float height = is_square && cloud->size_y > 0 ? cloud->size_y : cloud->size;
  return SpriteList{
      &points, &colors, {kind, 0.5f * Eigen::Vector3f(cloud->size, height, cloud->size)}};
}

}  // namespace afterglow::render
