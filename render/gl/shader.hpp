/// \file
/// The shaders of shaders/, embedded at build, compiled into programs.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "render/gl/gl_handle.hpp"

namespace afterglow::render {

struct EmbeddedShader {
  const char* name;  ///< file name; nullptr ends the list
  const char* text;
};
extern const EmbeddedShader kEmbeddedShaders[];

/// One stage made of several files, in order: a file may use those before it. The
/// files hold no #version; it is 4.5 core.
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
void setUniform(const Program& program, const char* name, const glm::vec2& value);
void setUniform(const Program& program, const char* name, const glm::vec3& value);
void setUniform(const Program& program, const char* name, const glm::vec4& value);
void setUniform(const Program& program, const char* name, const glm::mat4& value);

}  // namespace afterglow::render
