/// \file
/// A projector's beam in the air of a room, faint, and the halo around what it lights.
#pragma once

#include <vector>

#include "render/gl/gl_handle.hpp"
#include "render/gl/thrown_light.hpp"

namespace afterglow::render {

/// Draws the beam at a quarter of the picture's size.
class Beam {
 public:
  /// Texture units that it takes.
  static constexpr GLint kBeamUnit = 6, kGlowUnit = 7, kShadowUnit = 8, kHaloUnit = 10;

  /// Prepares a picture of that size. Throws std::runtime_error if the driver cannot make it.
  Beam(int width, int height);

  /// Binds the beam to kBeamUnit. `thrown` is the light on the GPU. SurfaceTarget's textures must
  /// be bound; `near` is that of the picture's depths.
  void draw(const ProjectedLight& light, const ThrownLight& thrown, const ObserverView& view,
            double near);

 private:
  static constexpr int kColumns = 40, kRows = 25;  ///< cells of the blurred image

  void setGlow(const ProjectedLight& light);
  void drawHalo(const ThrownLight& thrown, const ObserverView& view, double near);

  int width_, height_, halo_width_, halo_height_;
  std::vector<float> glow_values_;
  Texture beam_ = Texture::make(GL_TEXTURE_2D), glow_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer framebuffer_ = Framebuffer::make();
  Texture halo_ = Texture::make(GL_TEXTURE_2D), across_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer draw_halo_ = Framebuffer::make(), draw_across_ = Framebuffer::make();
  VertexArray no_vertices_ = VertexArray::make();
  Program program_, halo_program_, blur_program_;
};

}  // namespace afterglow::render
