/// \file
/// Owners of GL objects. Made, used and destroyed with their context current, in its thread.
#pragma once

#include <epoxy/gl.h>

#include <utility>

namespace afterglow::render {

/// Move-only; a moved-from handle owns nothing.
template <typename Traits>
class GlHandle {
 public:
  template <typename... Arguments>
  static GlHandle make(Arguments... arguments) {
    return GlHandle(Traits::create(arguments...));
  }
  GlHandle() = default;
  GlHandle(GlHandle&& other) noexcept : id_(other.release()) {}
  GlHandle& operator=(GlHandle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~GlHandle() {
    if (id_ != 0) Traits::destroy(id_);
  }

  GLuint id() const { return id_; }
  /// Gives the object away.
  GLuint release() { return std::exchange(id_, 0); }

 private:
  explicit GlHandle(GLuint id) : id_(id) {}
  GLuint id_ = 0;
};

struct BufferTraits {
  static GLuint create() {
    GLuint id = 0;
    glCreateBuffers(1, &id);
    return id;
  }
  static void destroy(GLuint id) { glDeleteBuffers(1, &id); }
};
struct TextureTraits {
  static GLuint create(GLenum target) {
    GLuint id = 0;
    glCreateTextures(target, 1, &id);
    return id;
  }
  static void destroy(GLuint id) { glDeleteTextures(1, &id); }
};
struct RenderbufferTraits {
  static GLuint create() {
    GLuint id = 0;
    glCreateRenderbuffers(1, &id);
    return id;
  }
  static void destroy(GLuint id) { glDeleteRenderbuffers(1, &id); }
};
struct FramebufferTraits {
  static GLuint create() {
    GLuint id = 0;
    glCreateFramebuffers(1, &id);
    return id;
  }
  static void destroy(GLuint id) { glDeleteFramebuffers(1, &id); }
};
struct VertexArrayTraits {
  static GLuint create() {
    GLuint id = 0;
    glCreateVertexArrays(1, &id);
    return id;
  }
  static void destroy(GLuint id) { glDeleteVertexArrays(1, &id); }
};
struct ShaderTraits {
  static GLuint create(GLenum stage) { return glCreateShader(stage); }
  static void destroy(GLuint id) { glDeleteShader(id); }
};
struct ProgramTraits {
  static GLuint create() { return glCreateProgram(); }
  static void destroy(GLuint id) { glDeleteProgram(id); }
};

using Buffer = GlHandle<BufferTraits>;
using Texture = GlHandle<TextureTraits>;
using Renderbuffer = GlHandle<RenderbufferTraits>;
using Framebuffer = GlHandle<FramebufferTraits>;
using VertexArray = GlHandle<VertexArrayTraits>;
using Shader = GlHandle<ShaderTraits>;
using Program = GlHandle<ProgramTraits>;

}  // namespace afterglow::render
