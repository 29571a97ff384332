#include "render/gl/shadow_map.hpp"

#include <cmath>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <stdexcept>

#include "render/gl/glm_eigen.hpp"
#include "render/scene/lens_domain.hpp"

namespace afterglow::render {

ShadowMap::ShadowMap() {
  glTextureStorage2D(depth_.id(), 1, GL_DEPTH_COMPONENT32F, kSize, kSize);
  // Outside the frustum nothing is in the way.
  const float far[4] = {1, 1, 1, 1};
  glTextureParameterfv(depth_.id(), GL_TEXTURE_BORDER_COLOR, far);
  glTextureParameteri(depth_.id(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  glTextureParameteri(depth_.id(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  glTextureParameteri(depth_.id(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(depth_.id(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
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
  glViewport(0, 0, kSize, kSize);
  glDepthMask(GL_TRUE);
  glClearDepth(1);
  glClear(GL_DEPTH_BUFFER_BIT);
}

}  // namespace afterglow::render
