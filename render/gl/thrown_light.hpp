/// \file
/// A projector's light as the shaders of a lit room need it: image, lens, depths, and where it is.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

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

}  // namespace afterglow::render
