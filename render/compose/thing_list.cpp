#include "render/compose/thing_list.hpp"

namespace afterglow::render {

PointPlacement pointPlacement(const Drawable& drawable, const Placed& placed) {
  const Eigen::Matrix4d T_world_cloud = drawable.pose.matrix().matrix();
  return {placed.P_optical_world * T_world_cloud, T_world_cloud.transpose() * placed.height,
          placed.flattened, placed.gain};
}

PointPlacement PointPlacement::from(const Eigen::Vector3f& origin) const {
  PointPlacement placement = *this;
  const Eigen::Vector4d at = origin.cast<double>().homogeneous();
  placement.P_optical_cloud.col(3) = P_optical_cloud * at;
  placement.height[3] = height.dot(at);
  return placement;
}

void SpriteShape::turnTo(const Eye& of_layer, const Eigen::Isometry3d& T_world_list) {
  const Eigen::Isometry3d T_list_world = T_world_list.inverse();
  eye_is_direction = of_layer.parallel;
  eye = (of_layer.parallel ? Eigen::Vector3d(T_list_world.linear() * -of_layer.R_world_eye.col(2))
                           : Eigen::Vector3d(T_list_world * of_layer.p_world))
            .cast<float>();
  right = (T_list_world.linear() * of_layer.R_world_eye.col(0)).cast<float>();
  up = (T_list_world.linear() * of_layer.R_world_eye.col(1)).cast<float>();
}

std::optional<SpriteList> spriteList(const Shape& shape) {
  using Kind = SpriteShape::Kind;
  if (const auto* list = std::get_if<ShapeList>(&shape)) {
    const Kind kind = list->kind == ShapeList::Kind::Cubes ? Kind::Box : Kind::Ball;
    return SpriteList{&list->points.get(), &list->colors.get(), nullptr, {kind, 0.5f * list->size}};
  }
  const auto* cloud = std::get_if<PointCloud>(&shape);
  if (cloud == nullptr || cloud->style == PointStyle::Points) return std::nullopt;
  const bool is_square =
      cloud->style == PointStyle::Squares || cloud->style == PointStyle::FlatSquares;
  const Kind kind = is_square                           ? Kind::Square
                    : cloud->style == PointStyle::Boxes ? Kind::Box
                                                        : Kind::Ball;
  const float height = is_square && cloud->size_y > 0 ? cloud->size_y : cloud->size;
  const Eigen::Vector3f size(cloud->size, height, cloud->size);
  return SpriteList{&cloud->points.get(), nullptr, &cloud->colors.get(), {kind, 0.5f * size}};
}

}  // namespace afterglow::render
