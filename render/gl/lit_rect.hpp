/// \file
/// Which part of a picture a projector's beam can be seen in: what is costly is drawn there alone.
#pragma once

#include <array>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

namespace afterglow::render {

struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;
};

/// Around all that lies in the world, meters.
struct WorldBox {
  glm::dvec3 low{0}, high{0};
};

/// Around the beam with these corners (directions from p_world_projector) as far as it stays within
/// the room. `P_clip_world` is the picture's. The whole picture, if the beam comes up to the eye.
PixelRect litRect(const glm::dvec3& p_world_projector, const std::array<glm::dvec3, 4>& corners,
                  const WorldBox& room, const glm::dmat4& P_clip_world, int width, int height);

}  // namespace afterglow::render
