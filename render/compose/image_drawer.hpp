/// \file
/// What draws a composed image: the CPU (paint/cpu_drawer.hpp) or OpenGL (gl/gl_drawer.hpp).
#pragma once

#include "render/compose/composed_image.hpp"
#include "render/scene/image.hpp"

namespace afterglow::render {

class ImageDrawer {
 public:
  virtual ~ImageDrawer() = default;
  /// Replaces what `image`, of the lens's size, held; black where nothing is.
  virtual void draw(const ComposedImage& composed, Image& image) = 0;
};

}  // namespace afterglow::render
