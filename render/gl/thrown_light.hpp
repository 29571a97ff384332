/// \file
/// A projector's light as the shaders of a lit room need it: image, lens, depths, and where it is.
///
/// A room's own shadows: how much of its lamp and of its sky reaches what is seen.
///
/// A projector's beam in the air of a room, faint, and the halo around what it lights.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "render/gl/gl_handle.hpp"
#include "render/gl/observer_renderer.hpp"

namespace afterglow::render {

/// The reach of light: depths of the room from the place of a projector or a lamp.
class ShadowMap {
 public:
  static constexpr int kSize = 768;

  explicit ShadowMap(int size = kSize);  ///< texels, each way

  /// Pinhole frustum around all that the lens shows; distortion is left to the look-up of the
  /// light.
  static glm::dmat4 clipFromOptical(const calib::Lens& lens);
  /// Size of a texel at a meter, meters.
  static double texelSize(const calib::Lens& lens);

  /// Empties the map; drawing goes into it from now on.
  void begin();
  const Texture& texture() const { return depth_; }

 private:
  int size_;
  Texture depth_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer framebuffer_ = Framebuffer::make();
};

bool isSameLens(const calib::Lens& a, const calib::Lens& b);

/// Image, lens, depths and pose of a projector.
class ThrownLight {
 public:
  /// Texture units that it takes.
  static constexpr GLint kImageUnit = 3, kShadowUnit = 9;

  /// Uploads the image and the projector's pose, and a new lens.
  void set(const ProjectedLight& light);
  /// The depths are the caller's to draw, with clipFromWorld.
  ShadowMap& shadowMap() { return shadow_map_; }
  const ShadowMap& shadowMap() const { return shadow_map_; }
  const glm::dmat4& clipFromWorld() const { return P_shadow_world_; }
  /// Sets the projector's uniforms of projected_light.glsl, and binds its textures.
  void use(const Program& program) const;

 private:
  void setLensOf(const ProjectedLight& light);

  ShadowMap shadow_map_;
  Texture image_;
  calib::Lens lens_;
  double shadow_texel_ = 0;
  glm::dmat4 P_shadow_optical_{1}, P_shadow_world_{1}, T_projector_world_{1};
  glm::dvec3 p_world_projector_{0};
};

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
