/// \file
/// Where the simulated robot thinks its odometry's origin lies in map. Exact unless told otherwise;
/// else measured as AMCL does: five times a second, known 0.1 s later, each time a little beside,
/// and errors that follow each other are alike. Metres, radians, nanoseconds of robot time.
#pragma once

#include <cstdint>
#include <deque>
#include <random>

#include "nodes/fetch/diff_drive.hpp"

namespace afterglow::nodes {

/// Standard deviations of a measured pose of the base. 0 and 0: exact, and known at once.
struct LocalizationErrors {
  double position = 0;  ///< m, in x and in y
  double yaw = 0;       ///< rad
  std::uint32_t seed = 2;
};

class FakeLocalization {
 public:
  FakeLocalization(const LocalizationErrors& errors, const DiffDrive& base);
  /// To be called at each of the base's steps.
  void step(Nanoseconds now, const DiffDrive& base);
  const Pose2& mapToOdom() const { return known_; }

 private:
  Pose2 measure(const DiffDrive& base);

  struct Measured {
    Nanoseconds known;  ///< from then on
    Pose2 map_to_odom;
  };
  LocalizationErrors errors_;
  std::mt19937 random_;
  Pose2 error_;  ///< of the latest measurement
  Nanoseconds next_{0};
  std::deque<Measured> measured_;
  Pose2 known_;
};

}  // namespace afterglow::nodes
