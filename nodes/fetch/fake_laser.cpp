#include "nodes/fetch/fake_laser.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::nodes {
namespace {

constexpr double kHalfRoom = 6, kLeastWay = 4;  // m

/// Along one axis, from inside the room; far away for a beam along the wall.
double wallDistance(double from, double toward, double half_room) {
  if (std::abs(toward) < 1e-9) return 1e9;
  return (std::copysign(half_room, toward) - from) / toward;
}

}  // namespace

FakeLaser::FakeLaser(const PlanarPose& start, double view, double noise, std::uint32_t seed)
    : half_room_(std::max({kHalfRoom, std::abs(start.x) + kLeastWay,
                           std::abs(start.y) + kLeastWay})),
      noise_(noise),
      view_(view),
      random_(seed) {}

double FakeLaser::rangeOf(const PlanarPose& T_map_laser, double heading) const {
  const double cx = std::cos(heading), cy = std::sin(heading);
  double range = std::min(wallDistance(T_map_laser.x, cx, half_room_),
                          wallDistance(T_map_laser.y, cy, half_room_));
  for (const RoundThing& thing : things_) {
    const double x = thing.x - T_map_laser.x, y = thing.y - T_map_laser.y;
    const double along = x * cx + y * cy;
    const double beside2 = x * x + y * y - along * along;
    const double inside2 = thing.radius * thing.radius - beside2;
    if (along > 0 && inside2 > 0) range = std::min(range, along - std::sqrt(inside2));
  }
  return range;
}

std::vector<float> FakeLaser::look(const PlanarPose& T_map_laser, bool is_upside_down) {
  std::vector<float> ranges;
  ranges.reserve(kBeams);
  for (std::size_t beam = 0; beam < kBeams; ++beam) {
    const double angle = (firstAngle() + static_cast<double>(beam) * angleStep()) *
                         (is_upside_down ? -1 : 1);
    // Three uniform numbers of deviation 1 / sqrt(12) each make a bell that is good enough.
    double bell = -1.5;
    for (int i = 0; i < 3; ++i) bell += static_cast<double>(random_()) / 4294967296.0;
    ranges.push_back(
        static_cast<float>(rangeOf(T_map_laser, T_map_laser.yaw + angle) + 2 * noise_ * bell));
  }
  return ranges;
}

}  // namespace afterglow::nodes
