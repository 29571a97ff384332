#include "render/gl/render_target.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "render/gl/shader.hpp"
#include "render/scene/smooth_edges.hpp"

namespace afterglow::render {
namespace {

constexpr int kSamples = 4;  // what Mesa's llvmpipe has, and every GPU

void withoutAlpha(const std::uint8_t* rgba, std::vector<std::uint8_t>& rgb) {
  for (std::size_t i = 0; i < rgb.size() / 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) rgb[3 * i + k] = rgba[4 * i + k];
  }
}

}  // namespace

RenderTarget::RenderTarget(int width, int height) : width_(width), height_(height) {
  glNamedRenderbufferStorageMultisample(color_.id(), kSamples, GL_RGBA8, width, height);
  glNamedRenderbufferStorageMultisample(depth_.id(), kSamples, GL_DEPTH24_STENCIL8, width, height);
  glNamedRenderbufferStorage(resolved_color_.id(), GL_RGBA8, width, height);
  glNamedFramebufferRenderbuffer(samples_.id(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color_.id());
  glNamedFramebufferRenderbuffer(samples_.id(), GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER,
                                 depth_.id());
  glNamedFramebufferRenderbuffer(resolved_.id(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                 resolved_color_.id());
  requireComplete(samples_, width, height);
  requireComplete(resolved_, width, height);
  const auto pixels = static_cast<GLsizeiptr>(width) * static_cast<GLsizeiptr>(height);
  glNamedBufferData(pixels_.id(), 4 * pixels, nullptr, GL_STREAM_READ);
}

void RenderTarget::begin(const glm::vec3& background_rgb) {
  glBindFramebuffer(GL_FRAMEBUFFER, samples_.id());
  clearAll(width_, height_, background_rgb);
}

void RenderTarget::beginReading() {
  glBlitNamedFramebuffer(samples_.id(), resolved_.id(), 0, 0, width_, height_, 0, 0, width_,
                         height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved_.id());
  glBindBuffer(GL_PIXEL_PACK_BUFFER, pixels_.id());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  glFlush();
}

void RenderTarget::read(Image& image) {
  image.width = width_;
  image.height = height_;
  image.rgb.resize(3 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  const void* pixels = glMapNamedBuffer(pixels_.id(), GL_READ_ONLY);
  if (pixels == nullptr) return image.rgb.assign(image.rgb.size(), 0);
  withoutAlpha(static_cast<const std::uint8_t*>(pixels), image.rgb);
  glUnmapNamedBuffer(pixels_.id());
}

SmoothedTarget::SmoothedTarget(int width, int height) : width_(width), height_(height) {
  glTextureStorage2D(color_.id(), 1, GL_RGBA8, width, height);
  glTextureStorage2D(depth_.id(), 1, GL_DEPTH24_STENCIL8, width, height);
  setSampling(color_, GL_LINEAR);
  setSampling(depth_, GL_NEAREST);
  glNamedFramebufferTexture(color_only_.id(), GL_COLOR_ATTACHMENT0, color_.id(), 0);
  glNamedFramebufferTexture(drawn_.id(), GL_COLOR_ATTACHMENT0, color_.id(), 0);
  glNamedFramebufferTexture(drawn_.id(), GL_DEPTH_STENCIL_ATTACHMENT, depth_.id(), 0);
  requireComplete(color_only_, width, height);
  requireComplete(drawn_, width, height);
}

void SmoothedTarget::beginMore() {
  glBindFramebuffer(GL_FRAMEBUFFER, drawn_.id());
  glViewport(0, 0, width_, height_);
}

Image SmoothedTarget::read() const {
  Image image = readRgb(color_only_, width_, height_);
  smoothEdges(image);
  return image;
}

void setSampling(const Texture& texture, GLenum filter, GLenum wrap) {
  glTextureParameteri(texture.id(), GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
  glTextureParameteri(texture.id(), GL_TEXTURE_MAG_FILTER, static_cast<GLint>(filter));
  glTextureParameteri(texture.id(), GL_TEXTURE_WRAP_S, static_cast<GLint>(wrap));
  glTextureParameteri(texture.id(), GL_TEXTURE_WRAP_T, static_cast<GLint>(wrap));
}

void drawScreen(const Framebuffer& framebuffer, int width, int height, const Program& program,
                const VertexArray& no_vertices) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
  glViewport(0, 0, width, height);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_BLEND);
  glUseProgram(program.id());
  glBindVertexArray(no_vertices.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void requireComplete(const Framebuffer& framebuffer, int width, int height) {
  const GLenum status = glCheckNamedFramebufferStatus(framebuffer.id(), GL_FRAMEBUFFER);
  if (status == GL_FRAMEBUFFER_COMPLETE) return;
  throw std::runtime_error(fmt::format(
      "GL cannot draw into an image of {} x {} (framebuffer status {})", width, height, status));
}

void clearAll(int width, int height, const glm::vec3& background_rgb) {
  glViewport(0, 0, width, height);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glStencilMask(0xff);
  glClearColor(background_rgb.r, background_rgb.g, background_rgb.b, 1);
  glClearDepth(1);
  glClearStencil(0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
}

Image readRgb(const Framebuffer& framebuffer, int width, int height) {
  Image image;
  readRgb(framebuffer, width, height, image);
  return image;
}

void readRgb(const Framebuffer& framebuffer, int width, int height, Image& image) {
  image.width = width;
  image.height = height;
  image.rgb.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer.id());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
}

}  // namespace afterglow::render
