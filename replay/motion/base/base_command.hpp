/// \file
/// The commands of a base: velocities within its limits; and where those on their way take it.
#pragma once

#include <deque>

#include "replay/messages/message.hpp"
#include "replay/motion/base/drive_timing.hpp"

namespace afterglow::replay {

struct CommandLimits : DriveLimits {
  double delay;            ///< s until the base does as it is told
  double longest_silence;  ///< s that the oldest odometry that counts is old
};

class BaseCommand {
 public:
  explicit BaseCommand(const CommandLimits& limits) : limits_(limits) {}

  /// Changes towards `wanted` as far as `seconds` allow.
  void change(const PlanarVelocity& wanted, double seconds);
  /// Slows down to this share at once, along the same curve.
  void slow(double share) {
    velocity_ = {velocity_.forward * share, velocity_.turn * share, velocity_.left * share};
  }
  /// Stands at once.
  void halt() { velocity_ = {}; }

  const PlanarVelocity& velocity() const { return velocity_; }
  bool isMoving() const { return !velocity_.isZero(); }

  /// The velocity is sent now.
  PlanarVelocity send(Stamp now);
  /// Returns where a base that was at `base` at `from` will be at `to`: each velocity on its way
  /// has its effect when its delay is over.
  PlanarPose predict(PlanarPose base, Stamp from, Stamp to) const;

 private:
  struct Sent {
    Stamp at;
    PlanarVelocity velocity;
  };

  CommandLimits limits_;
  PlanarVelocity velocity_;
  std::deque<Sent> sent_;  ///< commands that may not have had their effect
};

}  // namespace afterglow::replay
