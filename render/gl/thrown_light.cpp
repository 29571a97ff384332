#include "render/gl/thrown_light.hpp"

#include <algorithm>

#include "render/gl/glm_eigen.hpp"
#include "render/gl/shader.hpp"

namespace afterglow::render {
namespace {

constexpr float kGain = 8;  ///< white light at a meter, in units of what white paint shows as white

bool sameLens(const calib::Lens& a, const calib::Lens& b) {
  return a.width == b.width && a.height == b.height && a.K == b.K && a.D == b.D &&
         a.model == b.model;
}

void setSampling(const Texture& texture, GLenum filter, GLenum wrap) {
  glTextureParameteri(texture.id(), GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
  glTextureParameteri(texture.id(), GL_TEXTURE_MAG_FILTER, static_cast<GLint>(filter));
  glTextureParameteri(texture.id(), GL_TEXTURE_WRAP_S, static_cast<GLint>(wrap));
  glTextureParameteri(texture.id(), GL_TEXTURE_WRAP_T, static_cast<GLint>(wrap));
}

}  // namespace

ThrownLight::ThrownLight() {
  glTextureStorage2D(mask_.id(), 1, GL_R8, LitMask::kWidth, LitMask::kHeight);
  setSampling(mask_, GL_NEAREST, GL_CLAMP_TO_BORDER);  // whose color is black
}

void ThrownLight::setLensOf(const ProjectedLight& light) {
  if (lit_mask_ && sameLens(lens_, light.lens)) return;
  lens_ = light.lens;
  lit_mask_.emplace(lens_);
  P_shadow_optical_ = ShadowMap::clipFromOptical(lens_);
  shadow_texel_ = ShadowMap::texelSize(lens_);
  image_ = Texture::make(GL_TEXTURE_2D);
  glTextureStorage2D(image_.id(), 1, GL_RGBA8, lens_.width, lens_.height);
  setSampling(image_, GL_LINEAR, GL_CLAMP_TO_EDGE);
}

void ThrownLight::set(const ProjectedLight& light) {
  setLensOf(light);
  T_projector_world_ = toGlm(light.T_projector_world.matrix().matrix());
  p_world_projector_ = glm::dvec3(glm::inverse(T_projector_world_)[3]);
  P_shadow_world_ = P_shadow_optical_ * T_projector_world_;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(image_.id(), 0, 0, 0, lens_.width, lens_.height, GL_RGB, GL_UNSIGNED_BYTE,
                      light.image.rgb.data());
  glTextureSubImage2D(mask_.id(), 0, 0, 0, LitMask::kWidth, LitMask::kHeight, GL_RED,
                      GL_UNSIGNED_BYTE, lit_mask_->mark(light.image).data());
}

void ThrownLight::use(const Program& mark_program, const Program& lit_program) const {
  setUniform(mark_program, "lit_mask", kMaskUnit);
  setUniform(mark_program, "P_shadow_world", glm::mat4(P_shadow_world_));
  setUniform(lit_program, "projector_image", kImageUnit);
  setUniform(lit_program, "shadow_map", kShadowUnit);
  setLens(lit_program, lens_);
  setUniform(lit_program, "fold_radius", static_cast<float>(std::min(lens_.fold_radius, 1e6)));
  setUniform(lit_program, "shadow_texel", static_cast<float>(shadow_texel_));
  setUniform(lit_program, "projector_gain", kGain);
  setUniform(lit_program, "T_projector_world", glm::mat4(T_projector_world_));
  setUniform(lit_program, "P_shadow_optical", glm::mat4(P_shadow_optical_));
  setUniform(lit_program, "p_world_projector", glm::vec3(p_world_projector_));
  glBindTextureUnit(kImageUnit, image_.id());
  glBindTextureUnit(kShadowUnit, shadow_map_.texture().id());
  glBindTextureUnit(kMaskUnit, mask_.id());
}

}  // namespace afterglow::render
