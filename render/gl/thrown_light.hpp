/// \file
/// A projector's light as the shaders of a lit room need it: image, lens, depths, and where it is.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "render/gl/gl_handle.hpp"
#include "render/gl/lit_mask.hpp"
#include "render/gl/renderer.hpp"
#include "render/gl/shadow_map.hpp"

namespace afterglow::render {

class ThrownLight {
 public:
  /// Texture units that it takes.
  static constexpr GLuint kImageUnit = 0, kShadowUnit = 1, kMaskUnit = 2;

  ThrownLight();

  /// Uploads what a frame brings; what depends on the lens alone is kept while it stays the same.
  void set(const ProjectedLight& light);
  /// The depths are the caller's to draw, with clipFromWorld.
  ShadowMap& shadowMap() { return shadow_map_; }
  const Eigen::Matrix4d& clipFromWorld() const { return P_shadow_world_; }
  /// Sets the uniforms of mark_lit.frag and of lit.frag, and binds the textures.
  void use(const Program& mark_program, const Program& lit_program) const;

 private:
  void setLensOf(const ProjectedLight& light);

  ShadowMap shadow_map_;
  Texture image_, mask_ = Texture::make(GL_TEXTURE_2D);
  calib::Lens lens_;
  std::optional<LitMask> lit_mask_;
  double shadow_texel_ = 0;
  Eigen::Matrix4d P_shadow_optical_, P_shadow_world_, T_projector_world_;
  Eigen::Vector3d p_world_projector_;
};

/// float uniforms from double matrices and points.
void setMatrix(const Program& program, const char* name, const Eigen::Matrix4d& matrix);
void setPoint(const Program& program, const char* name, const Eigen::Vector3d& p);

}  // namespace afterglow::render
