/// \file
/// Drawables that are many small things alike.
#pragma once

#include <optional>

#include "render/paint/sprites.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Points into the shape it was made of. Of `shape`, kind and sizes are set.
struct SpriteList {
  const PointList* points;
  const ColorList* colors;
  SpriteShape shape;
};

/// Lists of cubes and spheres, and clouds of all styles but PointStyle::Points; absent: another
/// shape.
std::optional<SpriteList> spriteList(const Shape& shape);

}  // namespace afterglow::render
