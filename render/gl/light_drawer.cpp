#include "render/gl/light_drawer.hpp"

#include <cstddef>
#include <stdexcept>

#include "render/gl/gl_handle.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"

namespace afterglow::render {
namespace {

constexpr GLuint kInOutline = 0x80;  ///< stencil bit: within the layer's surface
constexpr GLuint kInShade = 0x40;    ///< and behind another one
constexpr GLuint kDrawnBits = 0x3f;  ///< stencil bits: the last translucent thing drawn here

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

}  // namespace

struct LightDrawer::Impl {
  explicit Impl(const calib::Lens& lens) : target(lens.width, lens.height) {
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

  void draw(const LightFrame& frame, Image& image) {
    begin(frame);
    bool was_flattened = false;
    for (const LightLayer& layer : frame.layers) {
      if (layer.flattened || was_flattened) {
        glDepthMask(GL_TRUE);
        glClear(GL_DEPTH_BUFFER_BIT);
      }
      was_flattened = layer.flattened;
      if (layer.mask >= 0) drawMask(frame.masks[static_cast<std::size_t>(layer.mask)]);
      for (const LightStep& step : layer.steps) draw(step, layer.mask >= 0);
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

  void drawMask(const LightMask& mask) {
    glStencilMask(kInOutline | kInShade);
    glClearStencil(mask.outline ? 0 : kInOutline);
    glClear(GL_STENCIL_BUFFER_BIT);
    glClearStencil(0);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glDisable(GL_DEPTH_TEST);
    if (mask.outline) invert(kInOutline, *mask.outline);
    for (const LightOutline& shade : mask.shades) {
      invert(kInShade, shade);
      glStencilMask(kInOutline | kInShade);
      glStencilFunc(GL_EQUAL, kInShade, kInShade);
      glStencilOp(GL_KEEP, GL_KEEP, GL_ZERO);
      drawTriangles(shade.first, shade.count);
    }
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  }

  void invert(GLuint bit, const LightOutline& outline) {
    glStencilMask(bit);
    glStencilFunc(GL_ALWAYS, 0, 0);
    glStencilOp(GL_KEEP, GL_KEEP, GL_INVERT);
    drawTriangles(outline.first, outline.count);
  }

  void draw(const LightStep& step, bool masked) {
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
      case LightStep::Kind::Run:
      case LightStep::Kind::Sprites:
        throw std::logic_error("a frame composed for the painter is not for OpenGL");
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
};

LightDrawer::LightDrawer(const calib::Lens& lens) : impl_(std::make_unique<Impl>(lens)) {}
LightDrawer::~LightDrawer() = default;
void LightDrawer::draw(const LightFrame& frame, Image& image) { impl_->draw(frame, image); }

}  // namespace afterglow::render
