/// \file
/// Where the simulated robot thinks its odometry's origin lies in map. Measured as AMCL does, on a
/// Fetch after 0.1 m or 0.25 rad of motion only, known 0.1 s later, each time a little beside if
/// told so, and errors that follow each other are alike. Metres, radians, nanoseconds of robot
/// time.
#pragma once

#include <cstdint>
#include <deque>
#include <random>

#include "nodes/fetch/diff_drive.hpp"

namespace afterglow::nodes {

struct LocalizationErrors {
  /// Standard deviations of a measured pose of the base.
  double position = 0;  ///< m, in x and in y
  double yaw = 0;       ///< rad
  std::uint32_t seed = 2;
  /// What the wheels have to go or turn before it measures again. Without both it measures five
  /// times a second, and if it is exact as well it always knows.
  double distance = 0.1, turn = 0.25;
};

class FakeLocalization {
 public:
  FakeLocalization(const LocalizationErrors& errors, const DiffDrive& base);
  /// To be called at each of the base's steps.
  void step(Nanoseconds now, const DiffDrive& base);
  /// Somebody tells it where it stands.
  void relocate(const DiffDrive& base);
  const PlanarPose& mapToOdom() const { return known_; }

 private:
  bool isDue(Nanoseconds now, const DiffDrive& base) const;
  PlanarPose measure(const DiffDrive& base);

  struct Measured {
    Nanoseconds known;  ///< from then on
    PlanarPose map_to_odom;
  };
  LocalizationErrors errors_;
  std::mt19937 random_;
  PlanarPose error_;  ///< of the latest measurement
  Nanoseconds next_{0};
  PlanarPose measured_at_;  ///< odometry of the latest measurement
  std::deque<Measured> measured_;
  PlanarPose known_;
};

}  // namespace afterglow::nodes
