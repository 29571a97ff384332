/// \file
/// The obedience of a base: a person who pushes it, or drives it by other means, is seen by its
/// odometry.
#pragma once

#include <array>
#include <deque>
#include <optional>
#include <string>

#include "replay/messages/message.hpp"
#include "replay/motion/planar_pose.hpp"
#include "replay/motion/pose_track.hpp"

namespace afterglow::replay {

/// m, s, rad. A base that is slower than told is left alone, as it may slow down by itself before
/// an obstacle; one that stands is not.
struct ObedienceOptions {
  double latency = 0.5;  ///< until odometry shows a command, at most
  /// The least deceleration.
  double deceleration = 0.4, turn_deceleration = 1.2;
  /// The speed above the command that is tolerated; a share of the speed in force is added.
  double tolerance = 0.15, turn_tolerance = 0.3, share = 0.15;
  double patience = 0.5;           ///< time for which it may be faster
  double standing_patience = 2.5;  ///< time for which it may stand
};

/// All stamps in ROS time, which may run slowly or stand. One thread at a time.
class BaseObedience {
 public:
  explicit BaseObedience(const ObedienceOptions& options) : options_(options) {}

  void told(Stamp now, const Velocity& velocity);
  /// Takes the base's pose by its odometry, whose own clock is `stamp`. Returns what is wrong, one
  /// clause; empty: nothing is.
  std::string moved(Stamp now, Stamp stamp, const PlanarPose& pose);

 private:
  using Motion = std::array<double, 3>;  ///< ahead, to the left, counter-clockwise
  struct Told {
    Stamp at;
    Motion motion;
  };

  std::optional<Motion> measure(Stamp stamp, const PlanarPose& pose);
  void moveBounds(Stamp now);
  bool isFaster(const Motion& motion) const;
  bool isTooLong(std::optional<Stamp>& since, bool holds, double patience, Stamp now) const;

  ObedienceOptions options_;
  std::deque<Told> told_;  ///< commands in force within the latency
  std::deque<StampedPose> seen_;
  Motion most_{}, least_{};  ///< the bounds of its motion now
  Stamp bounded_;            ///< time at which the bounds were moved
  std::optional<Stamp> faster_since_, stands_since_;
};

}  // namespace afterglow::replay
