/// \file
/// Draws composed images: the CPU (paint/cpu_drawer.hpp) or OpenGL (gl/gl_drawer.hpp).
#pragma once

#include "render/compose/composed_image.hpp"
#include "render/scene/image.hpp"

namespace afterglow::render {

class ImageDrawer {
 public:
  virtual ~ImageDrawer() = default;
  /// Draws all pixels of `image`, which has the lens's size; black where there is no content.
  virtual void draw(const ComposedImage& composed, Image& image) = 0;
};

}  // namespace afterglow::render
