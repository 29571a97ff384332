/// \file
/// A projector's beam in the air of a room, faint.
#pragma once

#include <vector>

#include "render/gl/gl_handle.hpp"
#include "render/gl/thrown_light.hpp"

namespace afterglow::render {

/// Draws the beam at a quarter of the picture's size.
class Beam {
 public:
  /// Texture units that it takes.
  static constexpr GLint kBeamUnit = 6, kGlowUnit = 7, kShadowUnit = 8;

  /// Prepares a picture of that size. Throws std::runtime_error if the driver cannot make it.
  Beam(int width, int height);

  /// Binds the beam to kBeamUnit. `depths` are the projector's. SurfaceTarget's textures must be
  /// bound; `near` is that of the picture's depths.
  void draw(const ProjectedLight& light, const ShadowMap& depths, const ObserverView& view,
            double near);

 private:
  static constexpr int kColumns = 40, kRows = 25;  ///< cells of the blurred image

  void setGlow(const ProjectedLight& light);

  int width_, height_;
  std::vector<float> glow_values_;
  Texture beam_ = Texture::make(GL_TEXTURE_2D), glow_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer framebuffer_ = Framebuffer::make();
  VertexArray no_vertices_ = VertexArray::make();
  Program program_;
};

}  // namespace afterglow::render
