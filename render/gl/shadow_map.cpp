#include "render/gl/shadow_map.hpp"

#include <stdexcept>

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

Eigen::Matrix4d ShadowMap::clipFromOptical(const calib::Lens& lens) {
  const LensDomain domain(lens);
  const Eigen::Vector2d size = domain.max() - domain.min(), sum = domain.max() + domain.min();
  Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
  P(0, 0) = 2 / size.x();
  P(0, 2) = -sum.x() / size.x();
  P(1, 1) = 2 / size.y();
  P(1, 2) = -sum.y() / size.y();
  P(2, 2) = 1;
  P(2, 3) = -2 * LensDomain::kNear;
  P(3, 2) = 1;
  return P;
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
