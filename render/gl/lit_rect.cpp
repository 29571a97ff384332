#include "render/gl/lit_rect.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

namespace afterglow::render {
namespace {

constexpr double kNearest = 0.05;  // meters before the eye
constexpr int kMargin = 3;         // px
constexpr double kAhead = 1e-9;

struct Exit {
  double distance = std::numeric_limits<double>::infinity();  ///< in units of the direction
  int plane = -1;                                             ///< of the box; 0 .. 5
};

Exit exitOf(const glm::dvec3& p, const glm::dvec3& direction, const WorldBox& box) {
  Exit exit;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(direction[i]) < kAhead) continue;
    const bool is_up = direction[i] > 0;
    const double distance = ((is_up ? box.high[i] : box.low[i]) - p[i]) / direction[i];
    if (distance < exit.distance) exit = {std::max(distance, 0.0), 2 * i + (is_up ? 1 : 0)};
  }
  return exit;
}

/// No point of the box is farther from there.
double farthest(const glm::dvec3& p, const WorldBox& box) {
  return glm::length(glm::max(glm::abs(box.low - p), glm::abs(box.high - p)));
}

/// Corners of the pyramid that the beam fills. Where it leaves the room through one plane that is
/// exact; else it ends beyond all of the room.
std::vector<glm::dvec3> pyramid(const glm::dvec3& p, const std::array<glm::dvec3, 4>& corners,
                                const WorldBox& room) {
  std::array<Exit, 4> exits;
  std::transform(corners.begin(), corners.end(), exits.begin(),
                 [&](const glm::dvec3& corner) { return exitOf(p, corner, room); });
  const bool is_one_plane = std::all_of(exits.begin(), exits.end(), [&](const Exit& exit) {
    return exit.plane >= 0 && exit.plane == exits[0].plane;
  });
  const glm::dvec3 ahead = glm::normalize(corners[0] + corners[1] + corners[2] + corners[3]);
  std::vector<glm::dvec3> points = {p};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const double beyond = farthest(p, room) / std::max(glm::dot(corners[i], ahead), kAhead);
    points.push_back(p + (is_one_plane ? exits[i].distance : beyond) * corners[i]);
  }
  return points;
}

}  // namespace

PixelRect litRect(const glm::dvec3& p_world_projector, const std::array<glm::dvec3, 4>& corners,
                  const WorldBox& room, const glm::dmat4& P_clip_world, int width, int height) {
  glm::dvec2 low(width, height), high(0);
  for (const glm::dvec3& p_world : pyramid(p_world_projector, corners, room)) {
    const glm::dvec4 clip = P_clip_world * glm::dvec4(p_world, 1);
    if (!(clip.w > kNearest)) return {0, 0, width, height};
    const glm::dvec2 pixel =
        (0.5 + 0.5 * glm::dvec2(clip) / clip.w) * glm::dvec2(width, height);
    low = glm::min(low, pixel);
    high = glm::max(high, pixel);
  }
  const glm::dvec2 size(width, height);
  low = glm::clamp(glm::floor(low) - static_cast<double>(kMargin), glm::dvec2(0), size);
  high = glm::clamp(glm::ceil(high) + static_cast<double>(kMargin), low, size);
  return {static_cast<int>(low.x), static_cast<int>(low.y), static_cast<int>(high.x - low.x),
          static_cast<int>(high.y - low.y)};
}

}  // namespace afterglow::render
