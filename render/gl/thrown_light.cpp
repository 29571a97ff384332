#include "render/gl/thrown_light.hpp"

#include <algorithm>
#include <cmath>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <stdexcept>

#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"
#include "render/scene/lens_domain.hpp"

namespace afterglow::render {
namespace {

constexpr float kGain = 8;  ///< white light at a meter, in units of what white paint shows as white

}  // namespace

bool isSameLens(const calib::Lens& a, const calib::Lens& b) {
  return a.width == b.width && a.height == b.height && a.K == b.K && a.D == b.D &&
         a.model == b.model;
}

void ThrownLight::setLensOf(const ProjectedLight& light) {
  if (image_.id() != 0 && isSameLens(lens_, light.lens)) return;
  lens_ = light.lens;
  P_shadow_optical_ = ShadowMap::clipFromOptical(lens_);
  shadow_texel_ = ShadowMap::texelSize(lens_);
  image_ = Texture::make(GL_TEXTURE_2D);
  glTextureStorage2D(image_.id(), 1, GL_RGBA8, lens_.width, lens_.height);
  setSampling(image_, GL_LINEAR);
}

void ThrownLight::set(const ProjectedLight& light) {
  setLensOf(light);
  T_projector_world_ = toGlm(light.T_projector_world.matrix().matrix());
  p_world_projector_ = glm::dvec3(glm::inverse(T_projector_world_)[3]);
  P_shadow_world_ = P_shadow_optical_ * T_projector_world_;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(image_.id(), 0, 0, 0, lens_.width, lens_.height, GL_RGB, GL_UNSIGNED_BYTE,
                      light.image.rgb.data());
}

void ThrownLight::use(const Program& program) const {
  setLens(program, lens_);
  setUniform(program, "projector_image", kImageUnit);
  setUniform(program, "shadow_map", kShadowUnit);
  setUniform(program, "shadow_texel", static_cast<float>(shadow_texel_));
  setUniform(program, "projector_gain", kGain);
  setUniform(program, "T_projector_world", glm::mat4(T_projector_world_));
  setUniform(program, "P_shadow_optical", glm::mat4(P_shadow_optical_));
  setUniform(program, "p_world_projector", glm::vec3(p_world_projector_));
  glBindTextureUnit(kImageUnit, image_.id());
  glBindTextureUnit(kShadowUnit, shadow_map_.texture().id());
}

// ------------------------------------------------------------------------------------- depths
ShadowMap::ShadowMap(int size) : size_(size) {
  glTextureStorage2D(depth_.id(), 1, GL_DEPTH_COMPONENT32F, size, size);
  // Outside the frustum nothing is in the way.
  const float far[4] = {1, 1, 1, 1};
  glTextureParameterfv(depth_.id(), GL_TEXTURE_BORDER_COLOR, far);
  setSampling(depth_, GL_LINEAR, GL_CLAMP_TO_BORDER);
  glTextureParameteri(depth_.id(), GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTextureParameteri(depth_.id(), GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  glNamedFramebufferTexture(framebuffer_.id(), GL_DEPTH_ATTACHMENT, depth_.id(), 0);
  glNamedFramebufferDrawBuffer(framebuffer_.id(), GL_NONE);
  glNamedFramebufferReadBuffer(framebuffer_.id(), GL_NONE);
  if (glCheckNamedFramebufferStatus(framebuffer_.id(), GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error("GL cannot draw into a depth texture");
  }
}

/// A frustum around the lens's axis, of the size that is wanted, moved on the image to where the
/// lens has it.
glm::dmat4 ShadowMap::clipFromOptical(const calib::Lens& lens) {
  const LensDomain domain(lens);
  const glm::dvec2 low = toGlm(domain.min()), high = toGlm(domain.max());
  const glm::dvec2 size = high - low, to_middle = -(high + low) / size;
  const glm::dmat4 P_around_axis =
      glm::infinitePerspectiveLH(2 * std::atan(size.y / 2), size.x / size.y, LensDomain::kNear);
  return glm::translate(glm::dmat4(1), glm::dvec3(to_middle, 0)) * P_around_axis;
}

double ShadowMap::texelSize(const calib::Lens& lens) {
  const LensDomain domain(lens);
  return (domain.max() - domain.min()).maxCoeff() / kSize;
}

void ShadowMap::begin() {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glViewport(0, 0, size_, size_);
  glDepthMask(GL_TRUE);
  glClearDepth(1);
  glClear(GL_DEPTH_BUFFER_BIT);
}

}  // namespace afterglow::render
