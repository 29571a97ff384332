#include "render/gl/render_target.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <cstring>
#include <stdexcept>

#include "render/gl/shader.hpp"
#include "render/scene/image.hpp"

namespace afterglow::render {
namespace {

constexpr GLuint kPackGroup = 256;   // of pack.comp
constexpr std::size_t kPacked = 12;  // bytes, of four pixels

}  // namespace

RenderTarget::RenderTarget(int width, int height)
    : width_(width),
      height_(height),
      image_bytes_(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
      pack_program_(makeProgram({{GL_COMPUTE_SHADER, {"pack.comp"}}})) {
  setUniform(pack_program_, "image_size", Eigen::Vector2i(width, height));
  constexpr GLbitfield kAccess = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  const auto size = static_cast<GLsizeiptr>(image_bytes_ + kPacked);
  glNamedBufferStorage(packed_.id(), size, nullptr, 0);
  glNamedBufferStorage(sent_.id(), size, nullptr, kAccess | GL_CLIENT_STORAGE_BIT);
  mapped_ = static_cast<const char*>(glMapNamedBufferRange(sent_.id(), 0, size, kAccess));
  if (mapped_ == nullptr) throw std::runtime_error("the GPU gives no memory to read from");
}

void RenderTarget::begin() {
  if (samples_.id() == 0) {
    samples_ = Framebuffer::make();
    const auto attach = [&](Texture& texture, GLenum format, GLenum attachment) {
      texture = Texture::make(GLenum{GL_TEXTURE_2D_MULTISAMPLE});
      glTextureStorage2DMultisample(texture.id(), kSamples, format, width_, height_, GL_TRUE);
      glNamedFramebufferTexture(samples_.id(), attachment, texture.id(), 0);
    };
    attach(color_, GL_RGBA8, GL_COLOR_ATTACHMENT0);
    attach(depth_, GL_DEPTH24_STENCIL8, GL_DEPTH_STENCIL_ATTACHMENT);
    requireComplete(samples_, width_, height_);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, samples_.id());
  clearAll(width_, height_);
}

void RenderTarget::beginReading(const Buffer* painted) {
  glBindTextureUnit(0, color_.id());
  setUniform(pack_program_, "is_painted", GLint{painted != nullptr});
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, packed_.id());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 5, painted != nullptr ? painted->id() : 0);
  glUseProgram(pack_program_.id());
  const auto packs = static_cast<GLuint>((image_bytes_ + kPacked - 1) / kPacked);
  glDispatchCompute((packs + kPackGroup - 1) / kPackGroup, 1, 1);
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  for (std::size_t part = 0; part < kParts; ++part) {
    const auto begin = static_cast<GLintptr>(partBegin(part));
    const auto end = static_cast<GLintptr>(part + 1 < kParts ? partBegin(part + 1) : image_bytes_);
    glCopyNamedBufferSubData(packed_.id(), sent_.id(), begin, begin, end - begin);
    glMemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    arrived_[part].reset(glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0));
  }
  glFlush();
}

void RenderTarget::read(Image& image, Workers& workers) {
  constexpr GLuint64 kPatience = 1'000'000'000;  // ns
  for (std::size_t part = 0; part < kParts; ++part) {
    while (glClientWaitSync(arrived_[part].get(), 0, kPatience) == GL_TIMEOUT_EXPIRED) continue;
    const std::size_t first = partBegin(part);
    const std::size_t size = (part + 1 < kParts ? partBegin(part + 1) : image_bytes_) - first;
    workers.share(size, [&](int, std::size_t begin, std::size_t end) {
      std::memcpy(image.rgb.data() + first + begin, mapped_ + first + begin, end - begin);
    });
  }
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
  Image image{width_, height_, {}};
  image.rgb.resize(3 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, color_only_.id());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
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

void clearAll(int width, int height) {
  glViewport(0, 0, width, height);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glStencilMask(0xff);
  glClearColor(0, 0, 0, 1);
  glClearDepth(1);
  glClearStencil(0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
}

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
