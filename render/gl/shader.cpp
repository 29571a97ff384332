#include "render/gl/shader.hpp"

#include <algorithm>
#include <array>
#include <glm/gtc/type_ptr.hpp>
#include <regex>
#include <stdexcept>

#include "render/gl/glm_eigen.hpp"

namespace afterglow::render {
namespace {

const char* sourceOf(const std::string& file) {
  for (const EmbeddedShader* shader = kEmbeddedShaders; shader->name; ++shader) {
    if (file == shader->name) return shader->text;
  }
  throw std::logic_error("no shader " + file + " is built in");
}

/// A stage's files as one text: compilers differ in how they number several, and in whether they
/// heed the file number of #line (Mesa 22.3 does not).
struct Joined {
  std::string text = "#version 450 core\n";
  std::vector<std::size_t> first_lines;  ///< where each file begins, counted from 1

  explicit Joined(const std::vector<std::string>& files) {
    for (const std::string& file : files) {
      first_lines.push_back(1 +
                            static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')));
      text += sourceOf(file);
      text += '\n';
    }
  }
};

/// Puts file and line where a compiler has text and line: Mesa "0:14(5): error", NVIDIA
/// "0(14) : error".
std::string withFileNames(const std::string& log, const std::vector<std::string>& files,
                          const Joined& joined) {
  static const std::regex place(R"((^|\n|ERROR: )0[:(](\d+)\)?)");
  std::string text;
  auto end = log.cbegin();
  for (std::sregex_iterator match(log.begin(), log.end(), place), last; match != last; ++match) {
    const std::size_t line = std::stoul((*match)[2]);
    std::size_t file = joined.first_lines.size();
    while (file > 0 && joined.first_lines[file - 1] > line) --file;
    text.append(end, (*match)[0].first);
    text += (*match)[1].str();
    text += file > 0
                ? files[file - 1] + ":" + std::to_string(line - joined.first_lines[file - 1] + 1)
                : "line " + std::to_string(line);
    end = (*match)[0].second;
  }
  return text.append(end, log.cend());
}

Shader compile(const ShaderStage& stage) {
  const Joined joined(stage.files);
  const char* text = joined.text.c_str();
  Shader shader = Shader::make(stage.stage);
  glShaderSource(shader.id(), 1, &text, nullptr);
  glCompileShader(shader.id());
  GLint done = 0, length = 0;
  glGetShaderiv(shader.id(), GL_COMPILE_STATUS, &done);
  if (done) return shader;
  glGetShaderiv(shader.id(), GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(length), '\0');
  glGetShaderInfoLog(shader.id(), length, nullptr, log.data());
  throw std::runtime_error("shader does not compile: " +
                           withFileNames(log.c_str(), stage.files, joined));
}

GLint locationOf(const Program& program, const char* name) {
  return glGetUniformLocation(program.id(), name);
}

}  // namespace

Program makeProgram(const std::vector<ShaderStage>& stages) {
  Program program = Program::make();
  std::string names;
  for (const ShaderStage& stage : stages) {
    const Shader shader = compile(stage);
    glAttachShader(program.id(), shader.id());
    for (const std::string& file : stage.files) names += " " + file;
  }
  glLinkProgram(program.id());
  GLint done = 0, length = 0;
  glGetProgramiv(program.id(), GL_LINK_STATUS, &done);
  if (done) return program;
  glGetProgramiv(program.id(), GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(length), '\0');
  glGetProgramInfoLog(program.id(), length, nullptr, log.data());
  throw std::runtime_error("shaders do not link:" + names + ": " + log.c_str());
}

void setLens(const Program& program, const calib::Lens& lens) {
  const glm::dmat3 K = toGlm(lens.K);
  setUniform(program, "lens_focal", glm::vec3(K[0][0], K[1][1], K[1][0]));
  setUniform(program, "lens_center", glm::vec2(K[2]));
  std::array<float, 8> D;
  std::transform(lens.D.begin(), lens.D.end(), D.begin(),
                 [](double d) { return static_cast<float>(d); });
  glProgramUniform1fv(program.id(), locationOf(program, "lens_D"), D.size(), D.data());
  setUniform(program, "lens_is_fisheye", GLint{lens.model == calib::LensModel::Equidistant});
}

void setUniform(const Program& program, const char* name, GLint value) {
  glProgramUniform1i(program.id(), locationOf(program, name), value);
}
void setUniform(const Program& program, const char* name, float value) {
  glProgramUniform1f(program.id(), locationOf(program, name), value);
}
void setUniform(const Program& program, const char* name, const glm::vec2& value) {
  glProgramUniform2fv(program.id(), locationOf(program, name), 1, glm::value_ptr(value));
}
void setUniform(const Program& program, const char* name, const glm::vec3& value) {
  glProgramUniform3fv(program.id(), locationOf(program, name), 1, glm::value_ptr(value));
}
void setUniform(const Program& program, const char* name, const glm::vec4& value) {
  glProgramUniform4fv(program.id(), locationOf(program, name), 1, glm::value_ptr(value));
}
void setUniform(const Program& program, const char* name, const glm::mat4& value) {
  glProgramUniformMatrix4fv(program.id(), locationOf(program, name), 1, GL_FALSE,
                            glm::value_ptr(value));
}

}  // namespace afterglow::render
