#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>

#include "render/gl/gl_handle.hpp"
#include "render/gl/painted_points.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/renderer.hpp"
#include "render/gl/shader.hpp"
#include "render/scene/light_frame.hpp"

namespace afterglow::render {
namespace {

constexpr GLuint kInOutline = 0x80;  ///< stencil bit: within the layer's surface
constexpr GLuint kDrawnBits = 0x7f;  ///< stencil bits: the last translucent thing drawn here

void setAttribute(const VertexArray& array, GLuint index, GLint count, GLenum type,
                  GLboolean normalize, std::size_t offset) {
  glEnableVertexArrayAttrib(array.id(), index);
  glVertexArrayAttribFormat(array.id(), index, count, type, normalize, static_cast<GLuint>(offset));
  glVertexArrayAttribBinding(array.id(), index, 0);
}

/// LightVertex; LightPoint begins with one.
VertexArray makeVertexArray(const Buffer& vertices, std::size_t stride) {
  VertexArray array = VertexArray::make();
  glVertexArrayVertexBuffer(array.id(), 0, vertices.id(), 0, static_cast<GLsizei>(stride));
  setAttribute(array, 0, 3, GL_FLOAT, GL_FALSE, offsetof(LightVertex, x));
  setAttribute(array, 1, 1, GL_FLOAT, GL_FALSE, offsetof(LightVertex, depth));
  setAttribute(array, 2, 4, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(LightVertex, color));
  return array;
}

template <typename T>
void upload(const Buffer& buffer, const std::vector<T>& values) {
  glNamedBufferData(buffer.id(), static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(),
                    GL_STREAM_DRAW);
}

/// What the way of drawing points is measured with: a cloud of a depth camera's coarsest image, a
/// meter before the lens.
Scene pointsToMeasure(const calib::Lens& lens) {
  constexpr int kColumns = 160, kRows = 120;
  PointCloud cloud;
  cloud.style = PointStyle::Points;
  cloud.size = 3;
  for (int i = 0; i < kColumns * kRows; ++i) {
    const Eigen::Vector2d share((i % kColumns + 0.5) / kColumns, (i / kColumns + 0.5) / kRows);
    const auto ray =
        calib::unproject(lens, share.cwiseProduct(Eigen::Vector2d(lens.width, lens.height)));
    if (ray) cloud.points.push_back(ray->cast<float>());
  }
  Layer layer;
  layer.drawables = {{{}, std::move(cloud), {}}};
  return {{layer}};
}

}  // namespace

struct ProjectorRenderer::Impl {
  Impl(GlContext& gl_context, const calib::Lens& lens)
      : context(gl_context),
        composer(lens),
        target(lens.width, lens.height),
        painted_points(lens.width, lens.height),
        painter(lens.width, lens.height, workers) {
    glVertexArrayElementBuffer(triangle_array.id(), index_buffer.id());
    setAttribute(point_array, 3, 1, GL_FLOAT, GL_FALSE, offsetof(LightPoint, size_px));
    const auto margin = static_cast<float>(LightComposer::kPointMargin);
    const auto width = static_cast<float>(lens.width), height = static_cast<float>(lens.height);
    for (const Program* program : {&triangle_program, &point_program}) {
      setLens(*program, lens);
      glProgramUniform4f(program->id(), uniform(*program, "viewport"), -margin, -margin,
                         width + 2 * margin, height + 2 * margin);
    }
  }

  void choose(Drawing wanted, const calib::Lens& lens) {
    if (wanted != Drawing::Measured) {
      const bool cpu = wanted == Drawing::Cpu;
      composer.paintPoints(cpu ? &workers : nullptr);
      description = std::string("points by ") + (cpu ? "the CPU" : "OpenGL") + " (configured)";
      return;
    }
    const Scene scene = pointsToMeasure(lens);
    const double gl_ms = frameTime(scene, nullptr), cpu_ms = frameTime(scene, &workers);
    composer.paintPoints(cpu_ms < gl_ms ? &workers : nullptr);
    char text[100];
    std::snprintf(text, sizeof(text), "points by %s (%.1f ms by the CPU, %.1f ms by OpenGL)",
                  cpu_ms < gl_ms ? "the CPU" : "OpenGL", cpu_ms, gl_ms);
    description = text;
  }

  /// The best of a few: the first makes buffers and machine code, any may be disturbed. ms
  double frameTime(const Scene& scene, Workers* painting) {
    using Clock = std::chrono::steady_clock;
    composer.paintPoints(painting);
    double best = 1e9;
    Image image;
    for (int i = 0; i < 4; ++i) {
      const Clock::time_point begin = Clock::now();
      render(scene, {}, image);
      best =
          std::min(best, std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    }
    return best;
  }

  void render(const Scene& scene, const Rigid<Projector, World>& T_projector_world, Image& image) {
    const LightFrame& frame = composer.compose(scene, T_projector_world);
    image.width = target.width();
    image.height = target.height();
    image.rgb.resize(3 * static_cast<std::size_t>(image.width) *
                     static_cast<std::size_t>(image.height));
    if (composer.paintsPoints() && frame.isPaintedOnly()) {
      painter.paintRgb(frame.screen_points, frame.runs, image.rgb.data());
    } else {
      draw(frame, image);
    }
  }

  void draw(const LightFrame& frame, Image& image) {
    context.makeCurrent();
    begin(frame);
    bool was_flattened = false;
    for (const LightLayer& layer : frame.layers) {
      if (layer.flattened || was_flattened) {
        glDepthMask(GL_TRUE);
        glClear(GL_DEPTH_BUFFER_BIT);
      }
      was_flattened = layer.flattened;
      if (layer.masked) drawMask(layer);
      for (const LightStep& step : layer.steps) draw(frame, step, layer.masked);
    }
    target.read(image);
  }

  void begin(const LightFrame& frame) {
    upload(vertex_buffer, frame.vertices);
    upload(index_buffer, frame.indices);
    upload(point_buffer, frame.points);
    const float black[3] = {0, 0, 0};
    target.begin(black);
    const auto margin = static_cast<int>(LightComposer::kPointMargin);
    glViewport(-margin, -margin, target.width() + 2 * margin, target.height() + 2 * margin);
    glEnable(GL_PROGRAM_POINT_SIZE);
    glEnable(GL_MULTISAMPLE);
    glEnable(GL_STENCIL_TEST);
    glDisable(GL_CULL_FACE);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    translucent_id = 0;
  }

  void drawMask(const LightLayer& layer) {
    glStencilMask(kInOutline);
    glClear(GL_STENCIL_BUFFER_BIT);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glDisable(GL_DEPTH_TEST);
    glStencilFunc(GL_ALWAYS, 0, 0);
    glStencilOp(GL_KEEP, GL_KEEP, GL_INVERT);
    drawTriangles(layer.mask_first, layer.mask_count);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  }

  void draw(const LightFrame& frame, const LightStep& step, bool masked) {
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glStencilMask(0);
    glStencilFunc(masked ? GL_EQUAL : GL_ALWAYS, kInOutline, kInOutline);
    switch (step.kind) {
      case LightStep::Kind::Opaque:
        glDisable(GL_BLEND);
        glDepthMask(GL_TRUE);
        return drawTriangles(step.first, step.count);
      case LightStep::Kind::Translucent:
        return drawTranslucent(step);
      case LightStep::Kind::Points:
        glEnable(GL_BLEND);
        glDepthMask(GL_FALSE);
        glUseProgram(point_program.id());
        glBindVertexArray(point_array.id());
        return glDrawArrays(GL_POINTS, static_cast<GLint>(step.first),
                            static_cast<GLsizei>(step.count));
      case LightStep::Kind::Painted:
        painted_points.draw(frame, step.first, painter);
    }
  }

  /// First where its nearest surface is, then that surface's light, once a sample: where faces
  /// overlap, they do not add up.
  void drawTranslucent(const LightStep& step) {
    glDisable(GL_BLEND);
    glDepthMask(GL_TRUE);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    drawTriangles(step.first, step.count);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glEnable(GL_BLEND);
    glDepthMask(GL_FALSE);
    glDepthFunc(GL_EQUAL);  // nothing but the pass before has left these depths, so no outline test
    glStencilMask(kDrawnBits);
    if (++translucent_id > kDrawnBits) {
      glClear(GL_STENCIL_BUFFER_BIT);
      translucent_id = 1;
    }
    glStencilFunc(GL_NOTEQUAL, static_cast<GLint>(translucent_id), kDrawnBits);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    drawTriangles(step.first, step.count);
  }

  void drawTriangles(std::uint32_t first, std::uint32_t count) {
    glUseProgram(triangle_program.id());
    glBindVertexArray(triangle_array.id());
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(first * sizeof(std::uint32_t)));
  }

  GlContext& context;
  LightComposer composer;
  RenderTarget target;
  Program triangle_program = makeProgram(
      {{GL_VERTEX_SHADER, {"lens.glsl", "light.vert"}}, {GL_FRAGMENT_SHADER, {"light.frag"}}});
  Program point_program = makeProgram(
      {{GL_VERTEX_SHADER, {"lens.glsl", "light.vert"}}, {GL_FRAGMENT_SHADER, {"point.frag"}}});
  Buffer vertex_buffer = Buffer::make(), index_buffer = Buffer::make(),
         point_buffer = Buffer::make();
  VertexArray triangle_array = makeVertexArray(vertex_buffer, sizeof(LightVertex));
  VertexArray point_array = makeVertexArray(point_buffer, sizeof(LightPoint));
  GLuint translucent_id = 0;

  PaintedPoints painted_points;
  Workers workers;
  PointPainter painter;
  std::string description;
};

ProjectorRenderer::ProjectorRenderer(GlContext& context, const calib::Lens& lens,
                                     Drawing points) {
  context.makeCurrent();
  impl_ = std::make_unique<Impl>(context, lens);
  impl_->choose(points, lens);
}

ProjectorRenderer::~ProjectorRenderer() { impl_->context.makeCurrent(); }

Image ProjectorRenderer::render(const Scene& scene,
                                const Rigid<Projector, World>& T_projector_world) {
  Image image;
  impl_->render(scene, T_projector_world, image);
  return image;
}

void ProjectorRenderer::render(const Scene& scene, const Rigid<Projector, World>& T_projector_world,
                               Image& image) {
  impl_->render(scene, T_projector_world, image);
}

const std::string& ProjectorRenderer::description() const { return impl_->description; }

}  // namespace afterglow::render
