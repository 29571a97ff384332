#include "render/gl/observer_renderer.hpp"

#include <cstddef>
#include <glm/ext/matrix_clip_space.hpp>
#include <optional>
#include <stdexcept>

#include "render/gl/beam.hpp"
#include "render/gl/glm_eigen.hpp"
#include "render/gl/lit_rect.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/room_shade.hpp"
#include "render/gl/shader.hpp"
#include "render/gl/solid_mesh.hpp"
#include "render/gl/surface_target.hpp"
#include "render/gl/thrown_light.hpp"

namespace afterglow::render {
namespace {

const glm::vec3 kBackground(0.03f, 0.033f, 0.04f);  // sRGB: dark beyond the modeled room

const glm::vec3 kGhost(0.62f, 0.88f, 1.0f);         // sRGB: of outlines
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
      : picture(width, height),
        surfaces(width, height, picture.depth()),
        shade(width, height),
        beam(width, height) {}
  SmoothedTarget picture;
  SurfaceTarget surfaces;
  RoomShade shade;
  Beam beam;
};

}  // namespace

struct ObserverRenderer::Impl {
  explicit Impl(GlContext& gl_context) : context(gl_context) {
    setUniform(seen_program, "reflected", SurfaceTarget::kReflectedUnit);
    setUniform(seen_program, "facing", SurfaceTarget::kFacingUnit);
    setUniform(seen_program, "thrown", SurfaceTarget::kThrownUnit);
    setUniform(seen_program, "reached", RoomShade::kShadeUnit);
    setUniform(seen_program, "beam", Beam::kBeamUnit);
    setUniform(seen_program, "background", kBackground);
  }

  Image render(const std::vector<Drawable>& solids, const ProjectedLight* light,
               const ObserverView& view) {
    check(view, light);
    context.makeCurrent();
    mesh.set(solids, eyeOf(view));
    if (!targets || targets->picture.width() != view.width ||
        targets->picture.height() != view.height) {
      targets.emplace(view.width, view.height);
    }
    drawDepths(light, view);
    drawSurfaces(view);
    const auto corners = light ? thrown_light.corners() : std::nullopt;
    const PixelRect rect =
        corners ? litRect(thrown_light.position(), *corners, mesh.bounds(), P_clip_world,
                          view.width, view.height)
                : PixelRect{};
    if (corners) drawThrown(rect);
    see(corners ? light : nullptr, rect, view);
    if (mesh.has(SolidMesh::Kind::Ghost)) drawGhosts();
    return targets->picture.read();
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
      mesh.drawSolids(depth_program);
    }
    targets->shade.beginLamp(view);
    setUniform(depth_program, "P_clip_world", glm::mat4(targets->shade.clipFromWorld()));
    mesh.drawSolids(depth_program);
  }

  void drawSurfaces(const ObserverView& view) {
    const glm::dmat4 T_world_observer = toGlm(view.T_world_observer.matrix().matrix());
    P_clip_world = clipFromObserver(view) * glm::inverse(T_world_observer);
    for (const Program* program : {&surface_program, &wood_program, &mark_program, &lit_program,
                                   &ghost_program}) {
      setUniform(*program, "P_clip_world", glm::mat4(P_clip_world));
      setUniform(*program, "p_world_observer", glm::vec3(T_world_observer[3]));
    }
    targets->surfaces.beginSurfaces();
    mesh.draw(surface_program, SolidMesh::Kind::Paint);
    mesh.draw(wood_program, SolidMesh::Kind::Wood);
  }

  /// Draws the visible surfaces that the projector may light once more, with its light;
  /// it reaches nothing outside of the rectangle.
  void drawThrown(const PixelRect& rect) {
    thrown_light.use(mark_program, lit_program);
    targets->surfaces.beginThrown();
    glEnable(GL_SCISSOR_TEST);
    glScissor(rect.x, rect.y, rect.width, rect.height);
    glDepthMask(GL_FALSE);
    glDepthFunc(GL_EQUAL);
    glEnable(GL_STENCIL_TEST);
    glStencilMask(1);
    glStencilFunc(GL_ALWAYS, 1, 1);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    mesh.drawSolids(mark_program);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glStencilFunc(GL_EQUAL, 1, 1);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    mesh.drawSolids(lit_program);
    glDisable(GL_SCISSOR_TEST);
  }

  void see(const ProjectedLight* light, const PixelRect& rect, const ObserverView& view) {
    targets->surfaces.bind();
    targets->shade.draw(view, kNear);
    targets->shade.bind();
    if (light) {
      targets->beam.draw(*light, thrown_light.shadowMap(), view, kNear, rect);
    } else {
      targets->beam.clear();
    }
    drawScreen(targets->picture.color(), view.width, view.height, seen_program, no_vertices);
  }

  /// Over the picture: a breath of what is gone, once where several parts lie behind each other,
  /// and its outline.
  void drawGhosts() {
    targets->picture.beginMore();
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_LEQUAL);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    mesh.draw(ghost_program, SolidMesh::Kind::Ghost);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glDepthFunc(GL_EQUAL);
    setUniform(ghost_program, "color", glm::vec4(kGhost, 0.09f));
    mesh.draw(ghost_program, SolidMesh::Kind::Ghost);
    // Half of a line lies within the body.
    glDepthFunc(GL_LEQUAL);
    glEnable(GL_POLYGON_OFFSET_FILL);
    glPolygonOffset(-4, -4000);
    setUniform(ghost_program, "color", glm::vec4(kGhost, 0.85f));
    mesh.draw(ghost_program, SolidMesh::Kind::Outline);
    glDisable(GL_POLYGON_OFFSET_FILL);
    glDisable(GL_BLEND);
  }

  GlContext& context;
  SolidMesh mesh;
  /// Several programs: software OpenGL pays for both sides of a branch, so the stencil keeps dark
  /// places from the costly program.
  Program surface_program = makeSolidProgram({"surface.frag"});
  Program wood_program = makeSolidProgram({"wood.frag"});
  Program mark_program = makeSolidProgram({"mark_lit.frag"});
  Program lit_program = makeSolidProgram({"srgb.glsl", "lens.glsl", "sent_light.glsl", "lit.frag"});
  Program depth_program = makeSolidProgram({"depth.frag"});
  Program ghost_program = makeSolidProgram({"even.frag"});
  Program seen_program =
      makeProgram({{GL_VERTEX_SHADER, {"screen.vert"}},
                   {GL_FRAGMENT_SHADER, {"srgb.glsl", "room_light.glsl", "seen.frag"}}});
  VertexArray no_vertices = VertexArray::make();
  ThrownLight thrown_light;
  std::optional<SeenTargets> targets;
  glm::dmat4 P_clip_world{1};
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
