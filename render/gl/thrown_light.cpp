#include "render/gl/thrown_light.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <stdexcept>

#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"
#include "render/scene/lens_domain.hpp"

namespace afterglow::render {
namespace {

constexpr float kGain = 8;  ///< white light at a meter, in units of what white paint shows as white

}  // namespace

bool isSameLens(const calib::Lens& a, const calib::Lens& b) {
  return a.width == b.width && a.height == b.height && a.K == b.K && a.D == b.D &&
         a.model == b.model;
}

void ThrownLight::setLensOf(const ProjectedLight& light) {
  if (image_.id() != 0 && isSameLens(lens_, light.lens)) return;
  lens_ = light.lens;
  P_shadow_optical_ = ShadowMap::clipFromOptical(lens_);
  shadow_texel_ = ShadowMap::texelSize(lens_);
  image_ = Texture::make(GL_TEXTURE_2D);
  glTextureStorage2D(image_.id(), 1, GL_RGBA8, lens_.width, lens_.height);
  setSampling(image_, GL_LINEAR);
}

void ThrownLight::set(const ProjectedLight& light) {
  setLensOf(light);
  T_projector_world_ = toGlm(light.T_projector_world.matrix().matrix());
  p_world_projector_ = glm::dvec3(glm::inverse(T_projector_world_)[3]);
  P_shadow_world_ = P_shadow_optical_ * T_projector_world_;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(image_.id(), 0, 0, 0, lens_.width, lens_.height, GL_RGB, GL_UNSIGNED_BYTE,
                      light.image.rgb.data());
}

void ThrownLight::use(const Program& program) const {
  setLens(program, lens_);
  setUniform(program, "projector_image", kImageUnit);
  setUniform(program, "shadow_map", kShadowUnit);
  setUniform(program, "shadow_texel", static_cast<float>(shadow_texel_));
  setUniform(program, "projector_gain", kGain);
  setUniform(program, "T_projector_world", glm::mat4(T_projector_world_));
  setUniform(program, "P_shadow_optical", glm::mat4(P_shadow_optical_));
  setUniform(program, "p_world_projector", glm::vec3(p_world_projector_));
  glBindTextureUnit(kImageUnit, image_.id());
  glBindTextureUnit(kShadowUnit, shadow_map_.texture().id());
}

// ------------------------------------------------------------------------------------- depths
ShadowMap::ShadowMap(int size) : size_(size) {
  glTextureStorage2D(depth_.id(), 1, GL_DEPTH_COMPONENT32F, size, size);
  // Outside the frustum nothing is in the way.
  const float far[4] = {1, 1, 1, 1};
  glTextureParameterfv(depth_.id(), GL_TEXTURE_BORDER_COLOR, far);
  setSampling(depth_, GL_LINEAR, GL_CLAMP_TO_BORDER);
  glTextureParameteri(depth_.id(), GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTextureParameteri(depth_.id(), GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  glNamedFramebufferTexture(framebuffer_.id(), GL_DEPTH_ATTACHMENT, depth_.id(), 0);
  glNamedFramebufferDrawBuffer(framebuffer_.id(), GL_NONE);
  glNamedFramebufferReadBuffer(framebuffer_.id(), GL_NONE);
  if (glCheckNamedFramebufferStatus(framebuffer_.id(), GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error("GL cannot draw into a depth texture");
  }
}

/// A frustum around the lens's axis, of the size that is wanted, moved on the image to where the
/// lens has it.
glm::dmat4 ShadowMap::clipFromOptical(const calib::Lens& lens) {
  const LensDomain domain(lens);
  const glm::dvec2 low = toGlm(domain.min()), high = toGlm(domain.max());
  const glm::dvec2 size = high - low, to_middle = -(high + low) / size;
  const glm::dmat4 P_around_axis =
      glm::infinitePerspectiveLH(2 * std::atan(size.y / 2), size.x / size.y, LensDomain::kNear);
  return glm::translate(glm::dmat4(1), glm::dvec3(to_middle, 0)) * P_around_axis;
}

double ShadowMap::texelSize(const calib::Lens& lens) {
  const LensDomain domain(lens);
  return (domain.max() - domain.min()).maxCoeff() / kSize;
}

void ShadowMap::begin() {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glViewport(0, 0, size_, size_);
  glDepthMask(GL_TRUE);
  glClearDepth(1);
  glClear(GL_DEPTH_BUFFER_BIT);
}

namespace {

const glm::dvec3 kToLamp(-0.503, 0.121, 0.856);  // as room_light.glsl has it
constexpr double kLampReach = 3.6;               // meters around what is looked at
constexpr double kLampDepth = 12;                // meters, before and behind
constexpr double kLookHeight = 0.5;              // over the floor

/// Returns where the middle of the view meets the room, roughly.
glm::dvec3 lookedAt(const ObserverView& view) {
  const glm::dvec3 p_eye = toGlm(Eigen::Vector3d(view.T_world_observer.matrix().translation()));
  const glm::dvec3 ahead =
      toGlm(Eigen::Vector3d(view.T_world_observer.matrix().linear().col(2)));
  const double to_floor = ahead.z < -1e-3 ? (kLookHeight - p_eye.z) / ahead.z : 5;
  return p_eye + ahead * std::clamp(to_floor, 1.0, 5.0);
}

/// Moves in whole texels with the view: shadows do not crawl.
glm::dmat4 lampClipFromWorld(const glm::dvec3& p_middle, double texel) {
  glm::dmat4 T_lamp_world = glm::lookAtLH(glm::dvec3(0), -kToLamp, glm::dvec3(0, 1, 0));
  glm::dvec3 middle = glm::dvec3(T_lamp_world * glm::dvec4(p_middle, 1));
  middle = glm::round(middle / texel) * texel;
  T_lamp_world = glm::translate(glm::dmat4(1), -middle) * T_lamp_world;
  return glm::orthoLH_NO(-kLampReach, kLampReach, -kLampReach, kLampReach, -kLampDepth,
                         kLampDepth) *
         T_lamp_world;
}

}  // namespace

RoomShade::RoomShade(int width, int height)
    : width_((width + 2) / 3),
      height_((height + 2) / 3),
      shade_(makeProgram({{GL_VERTEX_SHADER, {"screen.vert"}},
                          {GL_FRAGMENT_SHADER, {"seen_point.glsl", "shade.frag"}}})),
      soften_(makeProgram(
          {{GL_VERTEX_SHADER, {"screen.vert"}}, {GL_FRAGMENT_SHADER, {"soften_shade.frag"}}})) {
  glTextureStorage2D(rough_.id(), 1, GL_RGBA16F, width_, height_);
  glTextureStorage2D(soft_.id(), 1, GL_RGBA8, width_, height_);
  setSampling(rough_, GL_NEAREST);
  setSampling(soft_, GL_LINEAR);
  glNamedFramebufferTexture(draw_rough_.id(), GL_COLOR_ATTACHMENT0, rough_.id(), 0);
  glNamedFramebufferTexture(draw_soft_.id(), GL_COLOR_ATTACHMENT0, soft_.id(), 0);
  requireComplete(draw_rough_, width_, height_);
  requireComplete(draw_soft_, width_, height_);
}

void RoomShade::beginLamp(const ObserverView& view) {
  P_lamp_world_ = lampClipFromWorld(lookedAt(view), 2 * kLampReach / kLampMap);
  lamp_map_.begin();
}

void RoomShade::draw(const ObserverView& view, double near) {
  const glm::dmat4 T_world_observer = toGlm(view.T_world_observer.matrix().matrix());
  const double down = std::tan(view.vertical_fov / 2), across = down * view.width / view.height;
  setUniform(shade_, "depths", SurfaceTarget::kDepthUnit);
  setUniform(shade_, "facing", SurfaceTarget::kFacingUnit);
  setUniform(shade_, "lamp_depths", kLampUnit);
  setUniform(shade_, "ray_span", glm::vec2(across, down));
  setUniform(shade_, "near", static_cast<float>(near));
  setUniform(shade_, "R_observer_world", glm::mat4(glm::inverse(T_world_observer)));
  setUniform(shade_, "P_lamp_observer", glm::mat4(P_lamp_world_ * T_world_observer));
  setUniform(shade_, "lamp_texel", static_cast<float>(2 * kLampReach / kLampMap));
  setUniform(shade_, "lamp_reach", static_cast<float>(kLampReach));
  setUniform(shade_, "to_lamp",
             glm::vec3(glm::inverse(T_world_observer) * glm::dvec4(kToLamp, 0)));
  setUniform(soften_, "shade", kShadeUnit);
  glBindTextureUnit(kLampUnit, lamp_map_.texture().id());
  drawScreen(draw_rough_, width_, height_, shade_, no_vertices_);
  glBindTextureUnit(kShadeUnit, rough_.id());
  drawScreen(draw_soft_, width_, height_, soften_, no_vertices_);
}

void RoomShade::bind() const { glBindTextureUnit(kShadeUnit, soft_.id()); }

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
