#include "render/gl/observer_renderer.hpp"

#include <cstddef>
#include <glm/ext/matrix_clip_space.hpp>
#include <optional>
#include <stdexcept>

#include "render/gl/glm_eigen.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/room_shade.hpp"
#include "render/gl/shader.hpp"
#include "render/gl/surface_target.hpp"
#include "render/gl/thrown_light.hpp"
#include "render/scene/shaded_mesh.hpp"

namespace afterglow::render {
namespace {

const glm::vec3 kBackground(0.03f, 0.033f, 0.04f);  // sRGB: dark beyond the modeled room

constexpr double kNear = 0.05;  // meters

/// y down, as images have it: see RenderTarget::read.
glm::dmat4 clipFromObserver(const ObserverView& view) {
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
  return makeProgram(
      {{GL_VERTEX_SHADER, {"srgb.glsl", "solid.vert"}}, {GL_FRAGMENT_SHADER, fragment_files}});
}

/// All that depends on the picture's size.
struct SeenTargets {
  SeenTargets(int width, int height)
      : picture(width, height), surfaces(width, height, picture.depth()), shade(width, height) {}
  SmoothedTarget picture;
  SurfaceTarget surfaces;
  RoomShade shade;
};

}  // namespace

struct ObserverRenderer::Impl {
  explicit Impl(GlContext& gl_context) : context(gl_context) {
    glVertexArrayElementBuffer(array.id(), index_buffer.id());
    setAttribute<glm::vec3>(array, 0, offsetof(ShadedVertex, x));
    setAttribute<glm::vec3>(array, 1, offsetof(ShadedVertex, nx));
    setAttribute<glm::u8vec4>(array, 2, offsetof(ShadedVertex, color));
    setUniform(seen_program, "reflected", SurfaceTarget::kReflectedUnit);
    setUniform(seen_program, "facing", SurfaceTarget::kFacingUnit);
    setUniform(seen_program, "thrown", SurfaceTarget::kThrownUnit);
    setUniform(seen_program, "reached", RoomShade::kShadeUnit);
    setUniform(seen_program, "background", kBackground);
  }

  Image render(const std::vector<Drawable>& solids, const ProjectedLight* light,
               const ObserverView& view) {
    check(view, light);
    const ShadedMesh& mesh = builder.build(solids, eyeOf(view));
    context.makeCurrent();
    index_count = static_cast<GLsizei>(mesh.indices.size());
    upload(vertex_buffer, mesh.vertices);
    upload(index_buffer, mesh.indices);
    if (!targets || targets->picture.width() != view.width ||
        targets->picture.height() != view.height) {
      targets.emplace(view.width, view.height);
    }
    drawDepths(light, view);
    drawSurfaces(view);
    if (light) drawThrown();
    return see(view);
  }

  /// The room from the projector's place and from the lamp's.
  void drawDepths(const ProjectedLight* light, const ObserverView& view) {
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    if (light) {
      thrown_light.set(*light);
      setUniform(depth_program, "P_clip_world", glm::mat4(thrown_light.clipFromWorld()));
      thrown_light.shadowMap().begin();
      draw(depth_program);
    }
    targets->shade.beginLamp(view);
    setUniform(depth_program, "P_clip_world", glm::mat4(targets->shade.clipFromWorld()));
    draw(depth_program);
  }

  void drawSurfaces(const ObserverView& view) {
    const glm::dmat4 T_world_observer = toGlm(view.T_world_observer.matrix().matrix());
    const glm::dmat4 P_clip_world = clipFromObserver(view) * glm::inverse(T_world_observer);
    for (const Program* program : {&surface_program, &mark_program, &lit_program}) {
      setUniform(*program, "P_clip_world", glm::mat4(P_clip_world));
      setUniform(*program, "p_world_observer", glm::vec3(T_world_observer[3]));
    }
    targets->surfaces.beginSurfaces();
    draw(surface_program);
  }

  /// Draws the visible surfaces that the projector may light once more, with its light.
  void drawThrown() {
    thrown_light.use(mark_program, lit_program);
    targets->surfaces.beginThrown();
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

  Image see(const ObserverView& view) {
    targets->surfaces.bind();
    targets->shade.draw(view, kNear);
    targets->shade.bind();
    drawScreen(targets->picture.color(), view.width, view.height, seen_program, no_vertices);
    return targets->picture.read();
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
  Program surface_program = makeSolidProgram({"surface.frag"});
  Program mark_program = makeSolidProgram({"mark_lit.frag"});
  Program lit_program = makeSolidProgram({"srgb.glsl", "lens.glsl", "sent_light.glsl", "lit.frag"});
  Program depth_program = makeSolidProgram({"depth.frag"});
  Program seen_program =
      makeProgram({{GL_VERTEX_SHADER, {"screen.vert"}},
                   {GL_FRAGMENT_SHADER, {"srgb.glsl", "room_light.glsl", "seen.frag"}}});
  Buffer vertex_buffer = Buffer::make(), index_buffer = Buffer::make();
  VertexArray array = makeVertexArray<ShadedVertex>(vertex_buffer);
  VertexArray no_vertices = VertexArray::make();
  ThrownLight thrown_light;
  std::optional<SeenTargets> targets;
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
