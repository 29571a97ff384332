#include "render/gl/painted_points.hpp"

#include "render/gl/shader.hpp"

namespace afterglow::render {

PaintedPoints::PaintedPoints(int width, int height)
    : width_(width),
      height_(height),
      program_(makeProgram(
          {{GL_VERTEX_SHADER, {"screen.vert"}}, {GL_FRAGMENT_SHADER, {"painted.frag"}}})) {
  glTextureStorage2D(texture_.id(), 1, GL_RGBA8, width, height);
  glTextureParameteri(texture_.id(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(texture_.id(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

void PaintedPoints::draw(const LightFrame& frame, std::uint32_t run, PointPainter& painter) {
  pixels_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  one_run_.assign(1, frame.runs[run]);
  painter.paintRgba(frame.screen_points, one_run_, pixels_.data());
  glTextureSubImage2D(texture_.id(), 0, 0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE,
                      pixels_.data());
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glUseProgram(program_.id());
  glBindVertexArray(no_vertices_.id());
  glBindTextureUnit(0, texture_.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
}

}  // namespace afterglow::render
