/// \file
/// Many small things alike: clouds, and lists of cubes and spheres; their form and their way to the
/// image, as both back ends draw them.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "render/compose/composed_image.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// A list's way to the image.
struct PointPlacement {
  /// The way from the list's own frame: its pose, then the layer's placement, then the projector's
  /// pose.
  Eigen::Matrix4d P_optical_cloud = Eigen::Matrix4d::Identity();
  /// Height over the surface = height . p_cloud; for flattened layers.
  Eigen::Vector4d height = Eigen::Vector4d::Zero();
  bool flattened = false;  ///< higher hides lower; else nearer hides farther
  float gain = 1;          ///< multiplies r, g and b

  /// The placement of differences to `origin`, whose floats are exact enough wherever a list is.
  PointPlacement from(const Eigen::Vector3f& origin) const;
};
PointPlacement pointPlacement(const Drawable& drawable, const Placed& placed);

/// The thing at every point of a list. All in the list's own frame.
struct SpriteShape {
  enum class Kind { Square, Box, Ball } kind;
  /// Half sizes along x, y and z; a square's along its own two axes.
  Eigen::Vector3f half = Eigen::Vector3f::Ones();
  Eigen::Vector3f right = Eigen::Vector3f::UnitX(), up = Eigen::Vector3f::UnitY();  ///< a square's
  Eigen::Vector3f eye = Eigen::Vector3f::UnitZ();  ///< the viewer to whom the outline belongs
  bool eye_is_direction = false;                   ///< toward the eye

  /// Sets the square's axes and the eye.
  void turnTo(const Eye& eye, const Eigen::Isometry3d& T_world_list);
};

/// A drawable that is many small things alike. Points into the shape it was made of. Of `shape`,
/// kind and sizes are set.
struct SpriteList {
  const PointList* points;
  const ColorList* colors;           ///< the colors of a ShapeList
  const ByteColorList* byte_colors;  ///< the colors of a PointCloud; one of the two is nullptr
  SpriteShape shape;
};

/// Lists of cubes and spheres, and clouds of all styles but PointStyle::Points; absent: another
/// shape.
std::optional<SpriteList> spriteList(const Shape& shape);

}  // namespace afterglow::render
