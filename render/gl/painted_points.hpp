/// \file
/// Points painted by the CPU, laid over what OpenGL has drawn.
#pragma once

#include <cstdint>
#include <vector>

#include "render/gl/gl_handle.hpp"
#include "render/scene/light_frame.hpp"
#include "render/splat/point_painter.hpp"

namespace afterglow::render {

/// Used with the context current.
class PaintedPoints {
 public:
  PaintedPoints(int width, int height);

  /// Blends one run over the bound framebuffer where the stencil test that is set passes. Changes
  /// whether depth is tested and colors are blended: every step sets its own.
  void draw(const LightFrame& frame, std::uint32_t run, PointPainter& painter);

 private:
  int width_, height_;
  std::vector<std::uint32_t> pixels_;
  std::vector<PointRun> one_run_;
  Program program_;
  Texture texture_ = Texture::make(GL_TEXTURE_2D);
  VertexArray no_vertices_ = VertexArray::make();
};

}  // namespace afterglow::render
