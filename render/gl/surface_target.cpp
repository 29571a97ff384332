#include "render/gl/surface_target.hpp"

#include "render/gl/render_target.hpp"

namespace afterglow::render {

SurfaceTarget::SurfaceTarget(int width, int height, const Texture& depth)
    : width_(width), height_(height), depth_(depth) {
  glTextureStorage2D(reflected_.id(), 1, GL_RGBA8, width, height);
  glTextureStorage2D(facing_.id(), 1, GL_RGBA8, width, height);
  setSampling(reflected_, GL_NEAREST);
  setSampling(facing_, GL_NEAREST);
  glNamedFramebufferTexture(surfaces_.id(), GL_COLOR_ATTACHMENT0, reflected_.id(), 0);
  glNamedFramebufferTexture(surfaces_.id(), GL_COLOR_ATTACHMENT1, facing_.id(), 0);
  glNamedFramebufferTexture(surfaces_.id(), GL_DEPTH_STENCIL_ATTACHMENT, depth.id(), 0);
  const GLenum both[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  glNamedFramebufferDrawBuffers(surfaces_.id(), 2, both);
  requireComplete(surfaces_, width, height);
}

void SurfaceTarget::beginSurfaces() {
  const float none[4] = {0, 0, 0, 0};
  glBindFramebuffer(GL_FRAMEBUFFER, surfaces_.id());
  clearAll(width_, height_);  // with depth and stencil
  glClearBufferfv(GL_COLOR, 1, none);
}

void SurfaceTarget::bind() const {
  glBindTextureUnit(kReflectedUnit, reflected_.id());
  glBindTextureUnit(kFacingUnit, facing_.id());
  glBindTextureUnit(kDepthUnit, depth_.id());
}

}  // namespace afterglow::render
