/// \file
/// An image to draw into, whose edges are softened when it is read.
#pragma once

#include <glm/vec3.hpp>

#include "render/gl/gl_handle.hpp"
#include "render/scene/image.hpp"

namespace afterglow::render {

class SmoothedTarget {
 public:
  /// Throws std::runtime_error if the driver cannot make it.
  SmoothedTarget(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }

  /// Clears the target; drawing goes into it from now on.
  void begin(const glm::vec3& background_rgb);
  /// As RenderTarget::read.
  Image read();

 private:
  int width_, height_;
  Texture color_ = Texture::make(GL_TEXTURE_2D);
  Renderbuffer depth_ = Renderbuffer::make(), smoothed_color_ = Renderbuffer::make();
  Framebuffer drawn_ = Framebuffer::make(), smoothed_ = Framebuffer::make();
  VertexArray no_vertices_ = VertexArray::make();
  Program program_;
};

}  // namespace afterglow::render
