#include "render/gl/shader.hpp"

#include <algorithm>
#include <regex>
#include <stdexcept>

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
  std::vector<std::size_t> first_lines;  ///< lines where the files begin, counted from 1

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
  const Eigen::Matrix3f K = lens.K.cast<float>();
  const std::vector<float> D(lens.D.begin(), lens.D.end());
  setUniform(program, "lens_focal", Eigen::Vector3f(K(0, 0), K(1, 1), K(0, 1)));
  setUniform(program, "lens_center", Eigen::Vector2f(K(0, 2), K(1, 2)));
  setUniform(program, "lens_fold", static_cast<float>(std::min(lens.fold_radius, 1e6)));
  glProgramUniform1fv(program.id(), locationOf(program, "lens_D"), 8, D.data());
  setUniform(program, "lens_is_fisheye", GLint{lens.model == calib::LensModel::Equidistant});
}

void setUniform(const Program& program, const char* name, GLint value) {
  glProgramUniform1i(program.id(), locationOf(program, name), value);
}
void setUniform(const Program& program, const char* name, float value) {
  glProgramUniform1f(program.id(), locationOf(program, name), value);
}
void setUniform(const Program& program, const char* name, const Eigen::Vector2i& value) {
  glProgramUniform2i(program.id(), locationOf(program, name), value.x(), value.y());
}
void setFloats(const Program& program, const char* name, std::size_t count, const float* values) {
  const GLint at = locationOf(program, name);
  if (count == 2) glProgramUniform2fv(program.id(), at, 1, values);
  if (count == 3) glProgramUniform3fv(program.id(), at, 1, values);
  if (count == 4) glProgramUniform4fv(program.id(), at, 1, values);
  if (count == 16) glProgramUniformMatrix4fv(program.id(), at, 1, GL_FALSE, values);
}

}  // namespace afterglow::render
