/// \file
/// The way that joints take through the points of a trajectory, as controllers interpolate it:
/// between two points a line, a cubic or a quintic (Hermite), by whether both have positions only,
/// velocities or accelerations, too (Fetch's robot_controllers, ros_controllers). Radians, meters,
/// seconds.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace afterglow::replay {

/// The positions of all joints of a trajectory at a time of it, one number a joint.
struct ArmKnot {
  double at_s = 0;
  std::vector<double> positions, velocities, accelerations;  ///< the last two may be empty
};

/// The motion of a joint at a moment.
struct JointMotion {
  double position = 0, velocity = 0, acceleration = 0;
};
/// Interpolates on a line, a cubic or a quintic through both ends, by the degree. T: the segment's
/// length, which may be 0; t: since its start.
JointMotion interpolate(const JointMotion& a, const JointMotion& b, double T, double t,
                        int degree);

/// A value.
class ArmPath {
 public:
  /// Knots as they follow each other in time, one or more, all with as many positions.
  /// `is_continuous`, a joint each: it turns without an end and goes the short way from knot to
  /// knot.
  ArmPath(std::vector<ArmKnot> knots, std::vector<bool> is_continuous);

  double beginSeconds() const { return knots_.front().at_s; }
  double endSeconds() const { return knots_.back().at_s; }
  /// Unwound: a joint without an end goes on counting its turns.
  const std::vector<ArmKnot>& knots() const { return knots_; }
  /// Quantities that all knots have beside positions.
  bool hasVelocities() const { return degree_ > 1; }
  bool hasAccelerations() const { return degree_ > 3; }

  /// Always with velocities and accelerations, which are those of the interpolation. Before its
  /// begin and after its end the path stands.
  ArmKnot at(double seconds) const;
  /// The way of a joint from one position to another; the short one if it turns without an end.
  double way(std::size_t joint, double from, double to) const;

  /// Returns the place of these positions on the path: all of them within the tolerances. Of
  /// several such stretches the one around or next to `around_s`, not more than 10 s before it and
  /// 0.5 s after.
  std::optional<double> find(const std::vector<double>& positions,
                             const std::vector<double>& tolerances, double around_s) const;

 private:
  double farthest(double seconds, const std::vector<double>& positions,
                  const std::vector<double>& tolerances) const;

  std::vector<ArmKnot> knots_;
  std::vector<bool> is_continuous_;
  int degree_ = 5;
};

/// The departure of joints within a path.
struct ArmDeparture {
  double from_s = 0;  ///< the place on the path
  /// The joints' distances from it, which are made good on the way in `blend_s`.
  std::vector<double> offsets;
  double blend_s = 0;
  double pace = 0;    ///< speed that they have: 0 at rest, 1 as the path
  double ramp_s = 0;  ///< time in which they become as fast as the path

  /// Returns how much later they are than the path after that.
  double lostSeconds() const { return (1 - pace) / 2 * ramp_s; }
};

/// The knots of a departure, times since it: never backwards along the path nor, but for offsets
/// and a pace above 1, faster than it. The first one is where the joints are. Ends where the path
/// ends.
std::vector<ArmKnot> depart(const ArmPath& path, const ArmDeparture& departure);

}  // namespace afterglow::replay
