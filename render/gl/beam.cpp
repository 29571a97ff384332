#include "render/gl/beam.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "render/gl/glm_eigen.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"
#include "render/scene/lens_domain.hpp"

namespace afterglow::render {
namespace {

constexpr float kDust = 0.10f;  // of white light at a meter, a meter of air sends on
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

/// Lifts the mean, so that light in small parts is seen, too.
glm::vec3 lifted(const glm::vec3& mean) {
  const float most = std::max({mean.r, mean.g, mean.b});
  return most > 0 ? mean / std::sqrt(most) : mean;
}

}  // namespace

Beam::Beam(int width, int height)
    : width_((width + 3) / 4),
      height_((height + 3) / 4),
      program_(makeProgram(
          {{GL_VERTEX_SHADER, {"screen.vert"}}, {GL_FRAGMENT_SHADER, {"beam.frag"}}})) {
  glTextureStorage2D(beam_.id(), 1, GL_RGBA16F, width_, height_);
  glTextureStorage2D(glow_.id(), 1, GL_RGBA16F, kColumns, kRows);
  setSampling(beam_, GL_LINEAR);
  setSampling(glow_, GL_LINEAR);
  glNamedFramebufferTexture(framebuffer_.id(), GL_COLOR_ATTACHMENT0, beam_.id(), 0);
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

void Beam::draw(const ProjectedLight& light, const ShadowMap& depths, const ObserverView& view,
                double near) {
  glBindTextureUnit(kBeamUnit, beam_.id());
  setGlow(light);
  const glm::dmat4 P_shadow_observer =
      ShadowMap::clipFromOptical(light.lens) *
      toGlm(light.T_projector_world.matrix().matrix()) *
      toGlm(view.T_world_observer.matrix().matrix());
  const double down = std::tan(view.vertical_fov / 2), across = down * view.width / view.height;
  setUniform(program_, "depths", SurfaceTarget::kDepthUnit);
  setUniform(program_, "glow", kGlowUnit);
  setUniform(program_, "shadow_map", kShadowUnit);
  setUniform(program_, "ray_span", glm::vec2(across, down));
  setUniform(program_, "near", static_cast<float>(near));
  setUniform(program_, "P_shadow_observer", glm::mat4(P_shadow_observer));
  setUniform(program_, "dust", kDust);
  glBindTextureUnit(kGlowUnit, glow_.id());
  glBindTextureUnit(kShadowUnit, depths.texture().id());
  drawScreen(framebuffer_, width_, height_, program_, no_vertices_);
}

}  // namespace afterglow::render
