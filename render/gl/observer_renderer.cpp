#include "render/gl/observer_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/ext/matrix_clip_space.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"
#include "render/gl/solid_mesh.hpp"
#include "render/gl/thrown_light.hpp"

namespace afterglow::render {
namespace {

const glm::vec3 kBackground(0.03f, 0.033f, 0.04f);  // sRGB: dark beyond the modeled room

const glm::vec4 kGhost(0.46f, 0.48f, 0.51f, 0.25f);  // sRGB: never brighter than projected light
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

/// `light_files` say what of a projector's light there is.
Program makeSeenProgram(const std::vector<std::string>& light_files) {
  std::vector<std::string> files = {"srgb.glsl", "room_light.glsl"};
  files.insert(files.end(), light_files.begin(), light_files.end());
  files.emplace_back("seen.frag");
  return makeProgram({{GL_VERTEX_SHADER, {"screen.vert"}}, {GL_FRAGMENT_SHADER, files}});
}

/// The picture that was drawn last, and of what, but for the solids: a film's room often stands
/// still.
class LastPicture {
 public:
  bool isOf(const ProjectedLight* light, const ObserverView& view) const {
    return view_ && isSame(*view_, view) && isSame(light);
  }
  void forget() { view_.reset(); }
  void set(const ProjectedLight* light, const ObserverView& view, Image picture) {
    view_ = view;
    light_ = light ? std::optional<ProjectedLight>(*light) : std::nullopt;
    picture_ = std::move(picture);
  }
  const Image& picture() const { return picture_; }

 private:
  static bool isSame(const ObserverView& a, const ObserverView& b) {
    return a.width == b.width && a.height == b.height && a.vertical_fov == b.vertical_fov &&
           a.T_world_observer.matrix().matrix() == b.T_world_observer.matrix().matrix();
  }
  bool isSame(const ProjectedLight* other) const {
    if (!light_ || !other) return !light_ && !other;
    return light_->T_projector_world.matrix().matrix() ==
               other->T_projector_world.matrix().matrix() &&
           isSameLens(light_->lens, other->lens) && light_->image.rgb == other->image.rgb;
  }

  std::optional<ObserverView> view_;
  std::optional<ProjectedLight> light_;
  Image picture_;
};

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
    for (const Program* program : {&seen_program, &seen_dark_program}) {
      setUniform(*program, "reflected", SurfaceTarget::kReflectedUnit);
      setUniform(*program, "facing", SurfaceTarget::kFacingUnit);
      setUniform(*program, "reached", RoomShade::kShadeUnit);
      setUniform(*program, "background", kBackground);
    }
    setUniform(seen_program, "depths", SurfaceTarget::kDepthUnit);
    setUniform(seen_program, "near", static_cast<float>(kNear));
    setUniform(seen_program, "beam", Beam::kBeamUnit);
  }

  Image render(const std::vector<Drawable>& solids, const ProjectedLight* light,
               const ObserverView& view) {
    check(view, light);
    context.makeCurrent();
    const bool is_moved = mesh.set(solids, eyeOf(view));
    if (is_moved || !last.isOf(light, view)) {
      last.forget();  // should drawing fail
      last.set(light, view, draw(light != nullptr && isLit(light->image) ? light : nullptr, view));
    }
    return last.picture();
  }

  Image draw(const ProjectedLight* light, const ObserverView& view) {
    if (!targets || targets->picture.width() != view.width ||
        targets->picture.height() != view.height) {
      targets.emplace(view.width, view.height);
    }
    drawDepths(light, view);
    drawSurfaces(view);
    see(light, view);
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
    const glm::dmat4 P_clip_world = clipFromObserver(view) * glm::inverse(T_world_observer);
    for (const Program* program : {&surface_program, &wood_program, &ghost_program}) {
      setUniform(*program, "P_clip_world", glm::mat4(P_clip_world));
      setUniform(*program, "p_world_observer", glm::vec3(T_world_observer[3]));
    }
    targets->surfaces.beginSurfaces();
    glDepthFunc(GL_LESS);  // of two in one place the one that was listed last
    mesh.draw(surface_program, SolidMesh::Kind::Paint);
    mesh.draw(wood_program, SolidMesh::Kind::Wood);
  }

  void see(const ProjectedLight* light, const ObserverView& view) {
    targets->surfaces.bind();
    targets->shade.draw(view, kNear);
    targets->shade.bind();
    if (light) {
      targets->beam.draw(*light, thrown_light, view, kNear);
      thrown_light.use(seen_program);
      const double down = std::tan(view.vertical_fov / 2), across = down * view.width / view.height;
      setUniform(seen_program, "ray_span", glm::vec2(across, down));
      setUniform(seen_program, "T_world_observer",
                 glm::mat4(toGlm(view.T_world_observer.matrix().matrix())));
    }
    drawScreen(targets->picture.color(), view.width, view.height,
               light ? seen_program : seen_dark_program, no_vertices);
  }

  /// Draws over the picture: what is gone, once where several parts lie behind each other.
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
    setUniform(ghost_program, "color", kGhost);
    mesh.draw(ghost_program, SolidMesh::Kind::Ghost);
    glDisable(GL_BLEND);
  }

  GlContext& context;
  SolidMesh mesh;
  Program surface_program = makeSolidProgram({"surface.frag"});
  Program wood_program = makeSolidProgram({"wood.frag"});
  Program depth_program = makeSolidProgram({"depth.frag"});
  Program ghost_program = makeSolidProgram({"ghost.frag"});
  Program seen_program =
      makeSeenProgram({"seen_point.glsl", "lens.glsl", "sent_light.glsl", "projected_light.glsl"});
  Program seen_dark_program = makeSeenProgram({"no_light.glsl"});
  VertexArray no_vertices = VertexArray::make();
  ThrownLight thrown_light;
  std::optional<SeenTargets> targets;
  LastPicture last;
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
