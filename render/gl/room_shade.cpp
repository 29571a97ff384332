#include "render/gl/room_shade.hpp"

#include <algorithm>
#include <cmath>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>

#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"

namespace afterglow::render {
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

}  // namespace afterglow::render
