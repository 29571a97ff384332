/// \file
/// A projector's light as the shaders of a lit room need it: image, lens, depths, and where it is.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "render/gl/gl_handle.hpp"
#include "render/gl/lit_mask.hpp"
#include "render/gl/observer_renderer.hpp"
#include "render/gl/shadow_map.hpp"

namespace afterglow::render {

class ThrownLight {
 public:
  /// Texture units that it takes.
  static constexpr GLint kImageUnit = 0, kShadowUnit = 1, kMaskUnit = 2;

  ThrownLight();

  /// Uploads the image and the projector's pose, and a new lens.
  void set(const ProjectedLight& light);
  /// The depths are the caller's to draw, with clipFromWorld.
  ShadowMap& shadowMap() { return shadow_map_; }
  const glm::dmat4& clipFromWorld() const { return P_shadow_world_; }
  /// Sets the uniforms of mark_lit.frag and of lit.frag, and binds the textures.
  void use(const Program& mark_program, const Program& lit_program) const;

 private:
  void setLensOf(const ProjectedLight& light);

  ShadowMap shadow_map_;
  Texture image_, mask_ = Texture::make(GL_TEXTURE_2D);
  calib::Lens lens_;
  std::optional<LitMask> lit_mask_;
  double shadow_texel_ = 0;
  glm::dmat4 P_shadow_optical_{1}, P_shadow_world_{1}, T_projector_world_{1};
  glm::dvec3 p_world_projector_{0};
};

}  // namespace afterglow::render
