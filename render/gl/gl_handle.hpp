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

/// Traits of objects that OpenGL makes and destroys several at a time.
template <auto& kCreate, auto& kDestroy>
struct ListedTraits {
  template <typename... Arguments>
  static GLuint create(Arguments... arguments) {
    GLuint id = 0;
    kCreate(arguments..., 1, &id);
    return id;
  }
  static void destroy(GLuint id) { kDestroy(1, &id); }
};
struct ShaderTraits {
  static GLuint create(GLenum stage) { return glCreateShader(stage); }
  static void destroy(GLuint id) { glDeleteShader(id); }
};
struct ProgramTraits {
  static GLuint create() { return glCreateProgram(); }
  static void destroy(GLuint id) { glDeleteProgram(id); }
};

using Buffer = GlHandle<ListedTraits<glCreateBuffers, glDeleteBuffers>>;
using Texture = GlHandle<ListedTraits<glCreateTextures, glDeleteTextures>>;
using Renderbuffer = GlHandle<ListedTraits<glCreateRenderbuffers, glDeleteRenderbuffers>>;
using Framebuffer = GlHandle<ListedTraits<glCreateFramebuffers, glDeleteFramebuffers>>;
using VertexArray = GlHandle<ListedTraits<glCreateVertexArrays, glDeleteVertexArrays>>;
using Shader = GlHandle<ShaderTraits>;
using Program = GlHandle<ProgramTraits>;

}  // namespace afterglow::render
