#include "render/gl/beam.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"
#include "render/scene/lens_domain.hpp"

namespace afterglow::render {
namespace {

constexpr float kDust = 0.10f;  // of white light at a meter, a meter of air sends on
constexpr float kGlare = 0.65f;  // share of the light that is seen around what it lights
constexpr int kStep = 2;        // px; every second one is enough for a blur

/// Mean of a square of the image, 0 .. 1, roughly linear.
glm::vec3 meanAround(const Image& image, const Eigen::Vector2d& pixel, int half) {
  const int u0 = std::max(static_cast<int>(pixel.x()) - half, 0);
  const int v0 = std::max(static_cast<int>(pixel.y()) - half, 0);
  const int u1 = std::min(static_cast<int>(pixel.x()) + half, image.width);
  const int v1 = std::min(static_cast<int>(pixel.y()) + half, image.height);
  glm::vec3 sum(0);
  int count = 0;
  for (int v = v0; v < v1; v += kStep) {
    for (int u = u0; u < u1; u += kStep) {
      const std::uint8_t* rgb =
          &image.rgb[3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                          static_cast<std::size_t>(u))];
      const glm::vec3 sent = glm::vec3(rgb[0], rgb[1], rgb[2]) / 255.0f;
      sum += sent * sent;
      ++count;
    }
  }
  return count > 0 ? sum / static_cast<float>(count) : sum;
}

Program makeScreenProgram(const std::vector<std::string>& fragment_files) {
  return makeProgram({{GL_VERTEX_SHADER, {"screen.vert"}}, {GL_FRAGMENT_SHADER, fragment_files}});
}

/// Returns the tangents of half the view's angles, across and down.
glm::vec2 raySpan(const ObserverView& view) {
  const double down = std::tan(view.vertical_fov / 2);
  return {down * view.width / view.height, down};
}

/// Lifts the mean, so that light in small parts is seen, too.
glm::vec3 lifted(const glm::vec3& mean) {
  const float most = std::max({mean.r, mean.g, mean.b});
  return most > 0 ? mean / std::sqrt(most) : mean;
}

}  // namespace

Beam::Beam(int width, int height)
    : width_((width + 3) / 4),
      height_((height + 3) / 4),
      halo_width_((width + 7) / 8),
      halo_height_((height + 7) / 8),
      program_(makeScreenProgram({"beam.frag"})),
      halo_program_(makeScreenProgram({"srgb.glsl", "seen_point.glsl", "lens.glsl",
                                       "sent_light.glsl", "projected_light.glsl", "halo.frag"})),
      blur_program_(makeScreenProgram({"blur.frag"})) {
  glTextureStorage2D(beam_.id(), 1, GL_RGBA16F, width_, height_);
  for (const Texture* texture : {&halo_, &across_}) {
    glTextureStorage2D(texture->id(), 1, GL_RGBA16F, halo_width_, halo_height_);
    setSampling(*texture, GL_LINEAR, GL_CLAMP_TO_EDGE);
  }
  glTextureStorage2D(glow_.id(), 1, GL_RGBA16F, kColumns, kRows);
  setSampling(beam_, GL_LINEAR);
  setSampling(glow_, GL_LINEAR);
  glNamedFramebufferTexture(framebuffer_.id(), GL_COLOR_ATTACHMENT0, beam_.id(), 0);
  glNamedFramebufferTexture(draw_halo_.id(), GL_COLOR_ATTACHMENT0, halo_.id(), 0);
  glNamedFramebufferTexture(draw_across_.id(), GL_COLOR_ATTACHMENT0, across_.id(), 0);
  requireComplete(framebuffer_, width_, height_);
}

void Beam::setGlow(const ProjectedLight& light) {
  const LensDomain domain(light.lens);
  const Eigen::Vector2d cell =
      (domain.max() - domain.min()).cwiseQuotient(Eigen::Vector2d(kColumns, kRows));
  const int half = std::max(light.lens.width / kColumns, 2);
  glow_values_.clear();
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Eigen::Vector2d ray =
          domain.min() + cell.cwiseProduct(Eigen::Vector2d(column + 0.5, row + 0.5));
      const auto pixel = calib::project(light.lens, ray.homogeneous());
      const glm::vec3 glow = pixel ? lifted(meanAround(light.image, *pixel, half)) : glm::vec3(0);
      glow_values_.insert(glow_values_.end(), {glow.r, glow.g, glow.b});
    }
  }
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(glow_.id(), 0, 0, 0, kColumns, kRows, GL_RGB, GL_FLOAT,
                      glow_values_.data());
}

void Beam::drawHalo(const ThrownLight& thrown, const ObserverView& view, double near) {
  thrown.use(halo_program_);
  setUniform(halo_program_, "reflected", SurfaceTarget::kReflectedUnit);
  setUniform(halo_program_, "facing", SurfaceTarget::kFacingUnit);
  setUniform(halo_program_, "depths", SurfaceTarget::kDepthUnit);
  setUniform(halo_program_, "ray_span", raySpan(view));
  setUniform(halo_program_, "near", static_cast<float>(near));
  setUniform(halo_program_, "T_world_observer",
             glm::mat4(toGlm(view.T_world_observer.matrix().matrix())));
  drawScreen(draw_halo_, halo_width_, halo_height_, halo_program_, no_vertices_);
  setUniform(blur_program_, "picture", kHaloUnit);
  const auto blur = [&](const Texture& from, const Framebuffer& to, const Eigen::Vector2i& along) {
    glBindTextureUnit(kHaloUnit, from.id());
    setUniform(blur_program_, "along", along);
    drawScreen(to, halo_width_, halo_height_, blur_program_, no_vertices_);
  };
  blur(halo_, draw_across_, {1, 0});
  blur(across_, draw_halo_, {0, 1});
  glBindTextureUnit(kHaloUnit, halo_.id());
}

void Beam::draw(const ProjectedLight& light, const ThrownLight& thrown, const ObserverView& view,
                double near) {
  glBindTextureUnit(kBeamUnit, beam_.id());
  drawHalo(thrown, view, near);
  setGlow(light);
  const glm::dmat4 P_shadow_observer = ShadowMap::clipFromOptical(light.lens) *
                                       toGlm(light.T_projector_world.matrix().matrix()) *
                                       toGlm(view.T_world_observer.matrix().matrix());
  setUniform(program_, "depths", SurfaceTarget::kDepthUnit);
  setUniform(program_, "glow", kGlowUnit);
  setUniform(program_, "shadow_map", kShadowUnit);
  setUniform(program_, "ray_span", raySpan(view));
  setUniform(program_, "near", static_cast<float>(near));
  setUniform(program_, "P_shadow_observer", glm::mat4(P_shadow_observer));
  setUniform(program_, "dust", kDust);
  setUniform(program_, "halo", kHaloUnit);
  setUniform(program_, "glare", kGlare);
  glBindTextureUnit(kGlowUnit, glow_.id());
  glBindTextureUnit(kShadowUnit, thrown.shadowMap().texture().id());
  drawScreen(framebuffer_, width_, height_, program_, no_vertices_);
}

}  // namespace afterglow::render
