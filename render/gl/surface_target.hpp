/// \file
/// The room before it is lit: how each pixel's surface reflects, faces, and how deep it lies.
#pragma once

#include "render/gl/gl_handle.hpp"

namespace afterglow::render {

class SurfaceTarget {
 public:
  /// Texture units that bind() takes.
  static constexpr GLint kReflectedUnit = 0, kFacingUnit = 1, kDepthUnit = 2;

  /// Shares `depth`, depth and stencil of that size. Throws std::runtime_error if the driver cannot
  /// make it.
  SurfaceTarget(int width, int height, const Texture& depth);

  /// Clears all of it; surfaces (surface.frag and its like) are drawn into it from now on.
  void beginSurfaces();
  /// Binds the target's textures to be read.
  void bind() const;

 private:
  int width_, height_;
  const Texture& depth_;
  Texture reflected_ = Texture::make(GL_TEXTURE_2D), facing_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer surfaces_ = Framebuffer::make();
};

}  // namespace afterglow::render
