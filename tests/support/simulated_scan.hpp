/// \file
/// What a range finder would see of round things in a room, from anywhere.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "replay/motion/base/floor.hpp"
#include "tests/support/simulated_drive.hpp"

namespace afterglow::test {

/// A disc on the floor, m.
struct Disc {
  double x = 0, y = 0, radius = 0.1;
};

/// As a Fetch's: 220 degrees, 0.33 degrees between beams, 0.235 m ahead of the base's middle.
struct ScanShape {
  double first = -1.92, step = 0.0058;
  std::size_t beams = 663;
  double noise = 0;  ///< m, standard deviation
};

constexpr double kLaserAhead = 0.235;  // m

/// Of the discs and of a wall all around, 8 m away from the range finder.
inline replay::RangeScan rangesOf(const std::vector<Disc>& discs, const replay::PlanarPose& base,
                                  double now, const ScanShape& shape = {},
                                  std::uint32_t seed = 1) {
  Bell bell(seed);
  const replay::PlanarPose laser = compose(base, {kLaserAhead, 0, 0});
  replay::RangeScan scan;
  scan.stamp = stampAt(now);
  scan.angle_min = shape.first;
  scan.angle_increment = shape.step;
  scan.range_min = 0.05;
  scan.range_max = 25;
  for (std::size_t i = 0; i < shape.beams; ++i) {
    const double heading = laser.yaw + shape.first + static_cast<double>(i) * shape.step;
    const double cx = std::cos(heading), cy = std::sin(heading);
    double range = 8;
    for (const Disc& disc : discs) {
      const double x = disc.x - laser.x, y = disc.y - laser.y, along = x * cx + y * cy;
      const double in2 = disc.radius * disc.radius - (x * x + y * y - along * along);
      if (along > 0 && in2 > 0) range = std::min(range, along - std::sqrt(in2));
    }
    scan.ranges.push_back(static_cast<float>(range + bell(shape.noise)));
  }
  return scan;
}

inline std::shared_ptr<const replay::FloorScan> scanOf(
    const std::vector<Disc>& discs, const replay::PlanarPose& base, double now,
    const ScanShape& shape = {}, std::uint32_t seed = 1) {
  return std::make_shared<replay::FloorScan>(rangesOf(discs, base, now, shape, seed),
                                             replay::ScanMount{{kLaserAhead, 0}, {1, 0}, {0, 1}},
                                             nullptr, std::vector<replay::OwnPart>{});
}

}  // namespace afterglow::test
