#include "render/gl/thrown_light.hpp"

#include <algorithm>

#include "render/gl/shader.hpp"

namespace afterglow::render {
namespace {

constexpr float kGain = 8;  ///< white light at a metre, in units of what white paint shows as white

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

void setNumber(const Program& program, const char* name, double value) {
  glProgramUniform1f(program.id(), uniform(program, name), static_cast<float>(value));
}

}  // namespace

ThrownLight::ThrownLight() {
  glTextureStorage2D(mask_.id(), 1, GL_R8, LitMask::kWidth, LitMask::kHeight);
  setSampling(mask_, GL_NEAREST, GL_CLAMP_TO_BORDER);  // whose colour is black
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
  T_projector_world_ = light.T_projector_world.matrix().matrix();
  p_world_projector_ = light.T_projector_world.inverse().matrix().translation();
  P_shadow_world_ = P_shadow_optical_ * T_projector_world_;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(image_.id(), 0, 0, 0, lens_.width, lens_.height, GL_RGB, GL_UNSIGNED_BYTE,
                      light.image.rgb.data());
  glTextureSubImage2D(mask_.id(), 0, 0, 0, LitMask::kWidth, LitMask::kHeight, GL_RED,
                      GL_UNSIGNED_BYTE, lit_mask_->mark(light.image).data());
}

void ThrownLight::use(const Program& mark_program, const Program& lit_program) const {
  glProgramUniform1i(mark_program.id(), uniform(mark_program, "lit_mask"), kMaskUnit);
  setMatrix(mark_program, "P_shadow_world", P_shadow_world_);
  glProgramUniform1i(lit_program.id(), uniform(lit_program, "projector_image"), kImageUnit);
  glProgramUniform1i(lit_program.id(), uniform(lit_program, "shadow_map"), kShadowUnit);
  setLens(lit_program, lens_);
  setNumber(lit_program, "fold_radius", std::min(lens_.fold_radius, 1e6));
  setNumber(lit_program, "shadow_texel", shadow_texel_);
  setNumber(lit_program, "projector_gain", kGain);
  setMatrix(lit_program, "T_projector_world", T_projector_world_);
  setMatrix(lit_program, "P_shadow_optical", P_shadow_optical_);
  setPoint(lit_program, "p_world_projector", p_world_projector_);
  glBindTextureUnit(kImageUnit, image_.id());
  glBindTextureUnit(kShadowUnit, shadow_map_.texture().id());
  glBindTextureUnit(kMaskUnit, mask_.id());
}

void setMatrix(const Program& program, const char* name, const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix4f values = matrix.cast<float>();
  glProgramUniformMatrix4fv(program.id(), uniform(program, name), 1, GL_FALSE, values.data());
}

void setPoint(const Program& program, const char* name, const Eigen::Vector3d& p) {
  const Eigen::Vector3f values = p.cast<float>();
  glProgramUniform3fv(program.id(), uniform(program, name), 1, values.data());
}

}  // namespace afterglow::render
