/// \file
/// A base's laser, simulated, by default a Fetch's: what it sees of a room with four walls and of
/// round things that stand in it. Source of its limits: fetch_bringup's laser.launch. Frame: map;
/// meters, radians.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {

using replay::PlanarPose;

/// Something that stands in the room: a leg, a box.
struct RoundThing {
  double x = 0, y = 0, radius = 0;
};

class FakeLaser {
 public:
  static constexpr std::size_t kBeams = 661;
  static constexpr double kFetchView = 1.92;  ///< rad to either side: blind behind
  static constexpr double kNearest = 0.05, kFarthest = 25;
  static constexpr double kPeriod = 1 / 15.;  ///< s

  /// A room of 12 m by 12 m about the origin, larger where the robot stands elsewhere. `noise`:
  /// standard deviation of a range, m. `view`: rad that it looks to either side.
  explicit FakeLaser(const PlanarPose& start, double view = kFetchView, double noise = 0.01,
                     std::uint32_t seed = 3);

  double firstAngle() const { return -view_; }
  double angleStep() const { return 2 * view_ / (kBeams - 1); }

  /// Replaces the things that stand in the room.
  void setThings(std::vector<RoundThing> things) { things_ = std::move(things); }
  /// A range for each beam. A Fetch's is mounted upside down: it looks from left to right.
  std::vector<float> look(const PlanarPose& T_map_laser, bool is_upside_down);

 private:
  double rangeOf(const PlanarPose& T_map_laser, double heading) const;

  const double half_room_, noise_, view_;
  std::mt19937 random_;
  std::vector<RoundThing> things_;
};

}  // namespace afterglow::nodes
