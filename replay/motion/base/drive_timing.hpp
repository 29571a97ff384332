/// \file
/// The times of a base on a recorded track: as it was then, at a rate, where the base's limits let
/// it, and later where they do not, so that it comes to rest at the track's end and not beyond; and
/// the progress along it.
///
/// The commands of a base: velocities within its limits; and where those on their way take it.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/motion/pose_track.hpp"

namespace afterglow::replay {

/// Limits of a base, either way.
struct DriveLimits {
  double speed = 1.0;              ///< m/s
  double turn_speed = 2.0;         ///< rad/s
  double acceleration = 0.7;       ///< m/s^2, and as it brakes
  double turn_acceleration = 2.8;  ///< rad/s^2
};

/// Returns the accelerations of a recorded base, over 0.2 s; at least 0.2 m/s^2 and 0.5 rad/s^2, as
/// a base that crept shows nothing.
DriveLimits shownBy(const PoseTrack& track);

/// A value. The fastest pace that keeps the limits is found by a pass backward and one forward over
/// the track in steps of 50 ms: at both ends the base is at rest. Ramps of its speed are planned at
/// 85 % of the limit; what is left is for corrections.
class DriveTiming {
 public:
  static constexpr double kPlannedShare = 0.85;

  /// Throws std::invalid_argument for a rate or a limit that is not above zero.
  DriveTiming(const PoseTrack& track, const DriveLimits& limits, double rate);

  /// Returns recorded seconds a second, at most the rate.
  double paceAt(Stamp stamp) const;
  /// Returns how long the track takes, s.
  double seconds() const;
  double fastest() const { return fastest_; }  ///< m/s
  /// Returns the way from there to where it stands next, or turns on the spot, or turns back: m.
  double wayToRest(Stamp stamp) const;
  /// Returns the speed from which a base comes to rest within a way, though it does as it is told
  /// later than it is taken to.
  double speedFor(double way) const;

 private:
  struct Node {
    double speed = 0, turn = 0;  ///< speeds as recorded
    double pace = 0;
    double way = 0;  ///< way to its next rest, m
  };
  double at(Stamp stamp, double Node::*value) const;
  void measure(const PoseTrack& track);
  void slowDown(Node& node, const Node& beside) const;

  Stamp begin_;
  double step_;  ///< s
  double linear_ramp_, angular_ramp_;
  std::vector<Node> nodes_;
  double fastest_ = 0;
};

/// The progress of a replay along a recorded track, as a recorded stamp. It runs with the clock at
/// the pace it is given, a little faster while it is behind the replay's timeline, and never goes
/// back.
class PathTime {
 public:
  /// Throws std::invalid_argument for a rate that is not above zero.
  PathTime(Stamp begin, Stamp end, double rate);

  void advance(double seconds);

  Stamp now() const { return now_; }
  bool isAtEnd() const { return now_ >= end_; }
  /// Returns the stamp that it will have in so many seconds.
  Stamp in(double seconds) const;

  double rate() const { return rate_; }
  /// Sets the rate of recorded time to real time; the pace changes with it.
  void setRate(double rate);
  double pace() const { return pace_; }
  void setPace(double pace) { pace_ = pace; }

  /// Sets the stamp that it does not pass; at first there is no limit.
  void setLimit(Stamp limit) { limit_ = limit; }
  /// Takes the place of the replay's timeline; at first it is not known.
  void meet(Stamp recorded) { met_ = recorded; }

 private:
  Stamp now_;
  Stamp end_;
  std::optional<Stamp> limit_, met_;
  double rate_, pace_;
};

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
