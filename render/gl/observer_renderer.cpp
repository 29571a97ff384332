#include "render/gl/observer_renderer.hpp"

#include <cstddef>
#include <glm/ext/matrix_clip_space.hpp>
#include <optional>
#include <stdexcept>

#include "render/gl/glm_eigen.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"
#include "render/gl/thrown_light.hpp"
#include "render/scene/shaded_mesh.hpp"

namespace afterglow::render {
namespace {

const glm::vec3 kBackground(0.03f, 0.033f, 0.04f);  // sRGB: dark beyond the modeled room

/// y down, as images have it: see RenderTarget::read.
glm::dmat4 clipFromObserver(const ObserverView& view) {
  constexpr double kNear = 0.05;
  const double aspect = static_cast<double>(view.width) / view.height;
  return glm::infinitePerspectiveLH(view.vertical_fov, aspect, kNear);
}

Eye eyeOf(const ObserverView& view) {
  Eye eye;
  eye.R_world_eye = view.T_world_observer.matrix().linear();
  eye.p_world = view.T_world_observer.matrix().translation();
  return eye;
}

void check(const ObserverView& view, const ProjectedLight* light) {
  if (view.width <= 0 || view.height <= 0 || !(view.vertical_fov > 0 && view.vertical_fov < 3)) {
    throw std::logic_error("an observer's view needs a size and an angle between 0 and 3 rad");
  }
  if (!light) return;
  const Image& image = light->image;
  const std::size_t pixels =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if (image.width != light->lens.width || image.height != light->lens.height ||
      image.rgb.size() != 3 * pixels) {
    throw std::logic_error("a projected image's size is not its lens's");
  }
}

Program makeSolidProgram(const std::vector<std::string>& fragment_files) {
  return makeProgram({{GL_VERTEX_SHADER, {"room_light.glsl", "solid.vert"}},
                      {GL_FRAGMENT_SHADER, fragment_files}});
}

}  // namespace

struct ObserverRenderer::Impl {
  explicit Impl(GlContext& gl_context) : context(gl_context) {
    glVertexArrayElementBuffer(array.id(), index_buffer.id());
    setAttribute<glm::vec3>(array, 0, offsetof(ShadedVertex, x));
    setAttribute<glm::vec3>(array, 1, offsetof(ShadedVertex, nx));
    setAttribute<glm::u8vec4>(array, 2, offsetof(ShadedVertex, color));
  }

  Image render(const std::vector<Drawable>& solids, const ProjectedLight* light,
               const ObserverView& view) {
    check(view, light);
    const ShadedMesh& mesh = builder.build(solids, eyeOf(view));
    context.makeCurrent();
    index_count = static_cast<GLsizei>(mesh.indices.size());
    upload(vertex_buffer, mesh.vertices);
    upload(index_buffer, mesh.indices);
    begin();
    if (light) drawDepths(*light);
    if (!target || target->width() != view.width || target->height() != view.height) {
      target.emplace(view.width, view.height);
    }
    target->begin(kBackground);
    const glm::dmat4 T_world_observer = toGlm(view.T_world_observer.matrix().matrix());
    const glm::dmat4 P_clip_world = clipFromObserver(view) * glm::inverse(T_world_observer);
    for (const Program* program : {&room_program, &mark_program, &lit_program}) {
      setUniform(*program, "P_clip_world", glm::mat4(P_clip_world));
      setUniform(*program, "p_world_observer", glm::vec3(T_world_observer[3]));
    }
    draw(room_program);
    if (light) drawLit();
    return target->read();
  }

  void begin() {
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
  }

  /// The room from the projector's place.
  void drawDepths(const ProjectedLight& light) {
    thrown_light.set(light);
    setUniform(depth_program, "P_clip_world", glm::mat4(thrown_light.clipFromWorld()));
    thrown_light.shadowMap().begin();
    draw(depth_program);
  }

  /// Draws the visible surfaces that the projector may light once more, over the room.
  void drawLit() {
    thrown_light.use(mark_program, lit_program);
    glDepthMask(GL_FALSE);
    glDepthFunc(GL_EQUAL);
    glEnable(GL_STENCIL_TEST);
    glStencilMask(1);
    glStencilFunc(GL_ALWAYS, 1, 1);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    draw(mark_program);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glStencilFunc(GL_EQUAL, 1, 1);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    draw(lit_program);
  }

  void draw(const Program& program) {
    glUseProgram(program.id());
    glBindVertexArray(array.id());
    glDrawElements(GL_TRIANGLES, index_count, GL_UNSIGNED_INT, nullptr);
  }

  GlContext& context;
  ShadedMeshBuilder builder;
  /// Several programs: software OpenGL pays for both sides of a branch, so the stencil keeps dark
  /// places from the costly program.
  Program room_program = makeSolidProgram({"room_light.glsl", "room.frag"});
  Program mark_program = makeSolidProgram({"mark_lit.frag"});
  Program lit_program =
      makeSolidProgram({"lens.glsl", "sent_light.glsl", "room_light.glsl", "lit.frag"});
  Program depth_program = makeSolidProgram({"depth.frag"});
  Buffer vertex_buffer = Buffer::make(), index_buffer = Buffer::make();
  VertexArray array = makeVertexArray<ShadedVertex>(vertex_buffer);
  ThrownLight thrown_light;
  std::optional<SmoothedTarget> target;
  GLsizei index_count = 0;
};

ObserverRenderer::ObserverRenderer(GlContext& context) {
  context.makeCurrent();
  impl_ = std::make_unique<Impl>(context);
}

ObserverRenderer::~ObserverRenderer() { impl_->context.makeCurrent(); }

Image ObserverRenderer::render(const std::vector<Drawable>& solids, const ProjectedLight* light,
                               const ObserverView& view) {
  return impl_->render(solids, light, view);
}

}  // namespace afterglow::render
