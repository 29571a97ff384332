#include "render/gl/smoothed_target.hpp"

#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"

namespace afterglow::render {

SmoothedTarget::SmoothedTarget(int width, int height)
    : width_(width),
      height_(height),
      program_(makeProgram(
          {{GL_VERTEX_SHADER, {"screen.vert"}}, {GL_FRAGMENT_SHADER, {"smooth_edges.frag"}}})) {
  glTextureStorage2D(color_.id(), 1, GL_RGBA8, width, height);
  glTextureParameteri(color_.id(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(color_.id(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTextureParameteri(color_.id(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(color_.id(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glNamedRenderbufferStorage(depth_.id(), GL_DEPTH24_STENCIL8, width, height);
  glNamedRenderbufferStorage(smoothed_color_.id(), GL_RGBA8, width, height);
  glNamedFramebufferTexture(drawn_.id(), GL_COLOR_ATTACHMENT0, color_.id(), 0);
  glNamedFramebufferRenderbuffer(drawn_.id(), GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER,
                                 depth_.id());
  glNamedFramebufferRenderbuffer(smoothed_.id(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                 smoothed_color_.id());
  requireComplete(drawn_, width, height);
  requireComplete(smoothed_, width, height);
}

void SmoothedTarget::begin(const glm::vec3& background_rgb) {
  glBindFramebuffer(GL_FRAMEBUFFER, drawn_.id());
  clearAll(width_, height_, background_rgb);
}

Image SmoothedTarget::read() {
  glBindFramebuffer(GL_FRAMEBUFFER, smoothed_.id());
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_BLEND);
  glUseProgram(program_.id());
  glBindVertexArray(no_vertices_.id());
  glBindTextureUnit(0, color_.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  return readRgb(smoothed_, width_, height_);
}

}  // namespace afterglow::render
