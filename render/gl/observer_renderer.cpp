#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>

#include "render/gl/gl_handle.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/renderer.hpp"
#include "render/gl/shader.hpp"
#include "render/gl/shadow_map.hpp"
#include "render/scene/shaded_mesh.hpp"

namespace afterglow::render {
namespace {

constexpr GLuint kImageUnit = 0, kShadowUnit = 1;
constexpr float kProjectorGain = 3.2f;  ///< white light at a metre, in units of a lit room's white
constexpr float kBackground[3] = {0.045f, 0.05f,
                                  0.06f};  // sRGB: a dark room beyond what is modelled

void setMatrix(const Program& program, const char* name, const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix4f values = matrix.cast<float>();
  glProgramUniformMatrix4fv(program.id(), uniform(program, name), 1, GL_FALSE, values.data());
}

void setPoint(const Program& program, const char* name, const Eigen::Vector3d& p) {
  const Eigen::Vector3f values = p.cast<float>();
  glProgramUniform3fv(program.id(), uniform(program, name), 1, values.data());
}

/// y down, as images have it: see RenderTarget::read.
Eigen::Matrix4d clipFromObserver(const ObserverView& view) {
  constexpr double kNear = 0.05;
  const double slope = std::tan(view.vertical_fov / 2);
  Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
  P(0, 0) = view.height / (slope * view.width);
  P(1, 1) = 1 / slope;
  P(2, 2) = 1;
  P(2, 3) = -2 * kNear;
  P(3, 2) = 1;
  return P;
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
  if (light && light->image.rgb.size() != 3 * static_cast<std::size_t>(light->image.width) *
                                              static_cast<std::size_t>(light->image.height)) {
    throw std::logic_error("a projected image's size and bytes disagree");
  }
}

}  // namespace

struct ObserverRenderer::Impl {
  explicit Impl(GlContext& gl_context) : context(gl_context) {
    glVertexArrayVertexBuffer(array.id(), 0, vertex_buffer.id(), 0, sizeof(ShadedVertex));
    glVertexArrayElementBuffer(array.id(), index_buffer.id());
    const auto attribute = [&](GLuint index, GLint count, GLenum type, std::size_t offset) {
      glEnableVertexArrayAttrib(array.id(), index);
      glVertexArrayAttribFormat(array.id(), index, count, type, type == GL_UNSIGNED_BYTE,
                                static_cast<GLuint>(offset));
      glVertexArrayAttribBinding(array.id(), index, 0);
    };
    attribute(0, 3, GL_FLOAT, offsetof(ShadedVertex, x));
    attribute(1, 3, GL_FLOAT, offsetof(ShadedVertex, nx));
    attribute(2, 4, GL_UNSIGNED_BYTE, offsetof(ShadedVertex, color));
    glProgramUniform1i(room_program.id(), uniform(room_program, "projector_image"), kImageUnit);
    glProgramUniform1i(room_program.id(), uniform(room_program, "shadow_map"), kShadowUnit);
    glProgramUniform1f(room_program.id(), uniform(room_program, "projector_gain"), kProjectorGain);
  }

  Image render(const std::vector<Drawable>& solids, const ProjectedLight* light,
               const ObserverView& view) {
    check(view, light);
    const ShadedMesh& mesh = builder.build(solids, eyeOf(view));
    context.makeCurrent();
    upload(mesh);
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
    glEnable(GL_MULTISAMPLE);
    glDepthFunc(GL_LEQUAL);
    glProgramUniform1i(room_program.id(), uniform(room_program, "projector_on"), light ? 1 : 0);
    if (light) shine(*light);
    if (!target || target->width() != view.width || target->height() != view.height) {
      target.emplace(view.width, view.height);
    }
    target->begin(kBackground);
    const Eigen::Matrix4d T_observer_world = view.T_world_observer.inverse().matrix().matrix();
    setMatrix(room_program, "P_clip_world", clipFromObserver(view) * T_observer_world);
    setPoint(room_program, "p_world_observer", view.T_world_observer.matrix().translation());
    draw(room_program);
    return target->read();
  }

  void upload(const ShadedMesh& mesh) {
    index_count = static_cast<GLsizei>(mesh.indices.size());
    glNamedBufferData(vertex_buffer.id(),
                      static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(ShadedVertex)),
                      mesh.vertices.data(), GL_STREAM_DRAW);
    glNamedBufferData(index_buffer.id(),
                      static_cast<GLsizeiptr>(mesh.indices.size() * sizeof(std::uint32_t)),
                      mesh.indices.data(), GL_STREAM_DRAW);
  }

  /// The projector's depths, and what its light needs.
  void shine(const ProjectedLight& light) {
    const Eigen::Matrix4d T_projector_world = light.T_projector_world.matrix().matrix();
    const Eigen::Matrix4d P_shadow_optical = ShadowMap::clipFromOptical(light.lens);
    setMatrix(depth_program, "P_clip_world", P_shadow_optical * T_projector_world);
    shadow_map.begin();
    draw(depth_program);

    setLens(room_program, light.lens);
    setMatrix(room_program, "T_projector_world", T_projector_world);
    setMatrix(room_program, "P_shadow_optical", P_shadow_optical);
    setPoint(room_program, "p_world_projector",
             light.T_projector_world.inverse().matrix().translation());
    glProgramUniform1f(room_program.id(), uniform(room_program, "shadow_texel"),
                       static_cast<float>(ShadowMap::texelSize(light.lens)));
    glProgramUniform1f(room_program.id(), uniform(room_program, "fold_radius"),
                       static_cast<float>(std::min(light.lens.fold_radius, 1e6)));
    uploadImage(light.image);
    glBindTextureUnit(kImageUnit, image.id());
    glBindTextureUnit(kShadowUnit, shadow_map.texture().id());
  }

  void uploadImage(const Image& source) {
    if (image_width != source.width || image_height != source.height) {
      image = Texture::make(GL_TEXTURE_2D);
      glTextureStorage2D(image.id(), 1, GL_RGB8, source.width, source.height);
      glTextureParameteri(image.id(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
      glTextureParameteri(image.id(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
      glTextureParameteri(image.id(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
      glTextureParameteri(image.id(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
      image_width = source.width;
      image_height = source.height;
    }
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage2D(image.id(), 0, 0, 0, source.width, source.height, GL_RGB, GL_UNSIGNED_BYTE,
                        source.rgb.data());
  }

  void draw(const Program& program) {
    glUseProgram(program.id());
    glBindVertexArray(array.id());
    glDrawElements(GL_TRIANGLES, index_count, GL_UNSIGNED_INT, nullptr);
  }

  GlContext& context;
  ShadedMeshBuilder builder;
  Program room_program =
      makeProgram({{GL_VERTEX_SHADER, {"solid.vert"}},
                   {GL_FRAGMENT_SHADER,
                    {"lens.glsl", "room_light.glsl", "projected_light.glsl", "room.frag"}}});
  Program depth_program =
      makeProgram({{GL_VERTEX_SHADER, {"solid.vert"}}, {GL_FRAGMENT_SHADER, {"depth.frag"}}});
  Buffer vertex_buffer = Buffer::make(), index_buffer = Buffer::make();
  VertexArray array = VertexArray::make();
  ShadowMap shadow_map;
  std::optional<RenderTarget> target;
  Texture image;
  int image_width = 0, image_height = 0;
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
