#include "render/gl/shader.hpp"

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

/// Compilers name a source string by its number: Mesa "2:14(5): error", NVIDIA "2(14) : error".
std::string withFileNames(const std::string& log, const std::vector<std::string>& files) {
  static const std::regex place(R"((^|\n|ERROR: )(\d+)[:(](\d+)\)?)");
  std::string text;
  auto end = log.cbegin();
  for (std::sregex_iterator match(log.begin(), log.end(), place), last; match != last; ++match) {
    const std::size_t number = std::stoul((*match)[2]);
    text.append(end, (*match)[0].first);
    text += (*match)[1].str();
    text += number >= 1 && number <= files.size() ? files[number - 1] : (*match)[2].str();
    text += ":" + (*match)[3].str();
    end = (*match)[0].second;
  }
  return text.append(end, log.cend());
}

Shader compile(const ShaderStage& stage) {
  std::vector<std::string> numbered = {"#version 450 core\n"};
  for (std::size_t i = 0; i < stage.files.size(); ++i) {
    numbered.push_back("#line 1 " + std::to_string(i + 1) + "\n" + sourceOf(stage.files[i]));
  }
  std::vector<const char*> texts;
  for (const std::string& text : numbered) texts.push_back(text.c_str());
  Shader shader = Shader::make(stage.stage);
  glShaderSource(shader.id(), static_cast<GLsizei>(texts.size()), texts.data(), nullptr);
  glCompileShader(shader.id());
  GLint done = 0, length = 0;
  glGetShaderiv(shader.id(), GL_COMPILE_STATUS, &done);
  if (done) return shader;
  glGetShaderiv(shader.id(), GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(length), '\0');
  glGetShaderInfoLog(shader.id(), length, nullptr, log.data());
  throw std::runtime_error("shader does not compile: " + withFileNames(log.c_str(), stage.files));
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
  float D[8];
  for (int i = 0; i < 8; ++i) D[i] = static_cast<float>(lens.D[static_cast<std::size_t>(i)]);
  const auto k = [&](int row, int column) { return static_cast<float>(lens.K(row, column)); };
  glProgramUniform3f(program.id(), uniform(program, "lens_focal"), k(0, 0), k(1, 1), k(0, 1));
  glProgramUniform2f(program.id(), uniform(program, "lens_center"), k(0, 2), k(1, 2));
  glProgramUniform1fv(program.id(), uniform(program, "lens_D"), 8, D);
}

}  // namespace afterglow::render
