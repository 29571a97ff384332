/// \file
/// How the members of a vertex lie in its buffer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <type_traits>
#include <vector>

#include "render/gl/gl_handle.hpp"

namespace afterglow::render {

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
  constexpr bool is_bytes = std::is_same_v<Member, glm::u8vec4>;
  static_assert(is_bytes || sizeof(Member) % sizeof(float) == 0);
  constexpr GLint count = is_bytes ? 4 : static_cast<GLint>(sizeof(Member) / sizeof(float));
  glEnableVertexArrayAttrib(array.id(), index);
  glVertexArrayAttribFormat(array.id(), index, count, is_bytes ? GL_UNSIGNED_BYTE : GL_FLOAT,
                            is_bytes, static_cast<GLuint>(offset));
  glVertexArrayAttribBinding(array.id(), index, 0);
}

/// Replaces what the buffer held.
template <typename T>
void upload(const Buffer& buffer, const std::vector<T>& values) {
  glNamedBufferData(buffer.id(), static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(),
                    GL_STREAM_DRAW);
}

}  // namespace afterglow::render
