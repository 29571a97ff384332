/// \file
/// A room's own shadows: how much of its lamp and of its sky reaches what is seen.
#pragma once

#include <glm/mat4x4.hpp>

#include "render/gl/gl_handle.hpp"
#include "render/gl/observer_renderer.hpp"
#include "render/gl/thrown_light.hpp"

namespace afterglow::render {

/// Shades at a third of the picture's size: shadows of a lamp on the ceiling are soft.
class RoomShade {
 public:
  /// Texture units that it takes.
  static constexpr GLint kLampUnit = 4, kShadeUnit = 5;

  /// Prepares a picture of that size. Throws std::runtime_error if the driver cannot make it.
  RoomShade(int width, int height);

  /// The lamp's map for what is seen from there; the depths are the caller's to draw, with
  /// clipFromWorld.
  void beginLamp(const ObserverView& view);
  const glm::dmat4& clipFromWorld() const { return P_lamp_world_; }
  /// Draws the shade. SurfaceTarget's textures must be bound; `near` is that of its depths.
  void draw(const ObserverView& view, double near);
  /// Binds the shade to kShadeUnit.
  void bind() const;

 private:
  static constexpr int kLampMap = 1024;

  int width_, height_;
  ShadowMap lamp_map_{kLampMap};
  glm::dmat4 P_lamp_world_{1};
  Texture rough_ = Texture::make(GL_TEXTURE_2D), soft_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer draw_rough_ = Framebuffer::make(), draw_soft_ = Framebuffer::make();
  VertexArray no_vertices_ = VertexArray::make();
  Program shade_, soften_;
};

}  // namespace afterglow::render
