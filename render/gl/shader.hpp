/// \file
/// The shaders of shaders/, embedded at build, compiled into programs; their uniforms, and how
/// vertices lie in their buffers.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "calib/lens.hpp"
#include "render/gl/gl_handle.hpp"

namespace afterglow::render {

inline glm::dvec2 toGlm(const Eigen::Vector2d& v) { return {v.x(), v.y()}; }
inline glm::dvec3 toGlm(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// M(row, column) is [column][row].
template <int kSize>
glm::mat<kSize, kSize, double> toGlm(const Eigen::Matrix<double, kSize, kSize>& M) {
  glm::mat<kSize, kSize, double> result;
  for (int column = 0; column < kSize; ++column) {
    for (int row = 0; row < kSize; ++row) result[column][row] = M(row, column);
  }
  return result;
}

struct EmbeddedShader {
  const char* name;  ///< file name; nullptr ends the list
  const char* text;
};
extern const EmbeddedShader kEmbeddedShaders[];

/// A stage made of several files, in order: a file may use those before it. The files hold no
/// `#version`; it is 4.5 core.
struct ShaderStage {
  GLenum stage;
  std::vector<std::string> files;
};

/// Throws std::runtime_error with the compiler's words, file and line, or std::logic_error for a
/// file that is not embedded.
Program makeProgram(const std::vector<ShaderStage>& stages);

/// Sets the uniforms of lens.glsl.
void setLens(const Program& program, const calib::Lens& lens);

/// A uniform that the program does not use is ignored.
void setUniform(const Program& program, const char* name, GLint value);  ///< a texture's unit, too
void setUniform(const Program& program, const char* name, float value);
void setFloats(const Program& program, const char* name, std::size_t count, const float* values);
void setUniform(const Program& program, const char* name, const Eigen::Vector2i& value);
/// Vectors and 4x4 matrices of floats, GLM's and Eigen's, whose columns follow each other.
template <typename Floats, typename = std::enable_if_t<std::is_class_v<Floats>>>
void setUniform(const Program& program, const char* name, const Floats& value) {
  setFloats(program, name, sizeof(Floats) / sizeof(float), reinterpret_cast<const float*>(&value));
}

// ---------------------------------------------------------------------------------- vertices
template <typename Vertex>
VertexArray makeVertexArray(const Buffer& vertices) {
  VertexArray array = VertexArray::make();
  glVertexArrayVertexBuffer(array.id(), 0, vertices.id(), 0, sizeof(Vertex));
  return array;
}

/// The shader's input `index` is the member of that type (float, glm::vec3, glm::u8vec4 ...) and
/// offset. Bytes arrive as 0 to 1.
template <typename Member>
void setAttribute(const VertexArray& array, GLuint index, std::size_t offset) {
  constexpr bool kIsBytes = std::is_same_v<Member, glm::u8vec4>;
  static_assert(kIsBytes || sizeof(Member) % sizeof(float) == 0);
  constexpr auto kCount = static_cast<GLint>(sizeof(Member) / (kIsBytes ? 1 : sizeof(float)));
  glEnableVertexArrayAttrib(array.id(), index);
  glVertexArrayAttribFormat(array.id(), index, kCount, kIsBytes ? GL_UNSIGNED_BYTE : GL_FLOAT,
                            kIsBytes, static_cast<GLuint>(offset));
  glVertexArrayAttribBinding(array.id(), index, 0);
}

/// Replaces what the buffer held.
template <typename T>
void upload(const Buffer& buffer, const std::vector<T>& values) {
  glNamedBufferData(buffer.id(), static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(),
                    GL_STREAM_DRAW);
}

}  // namespace afterglow::render
