/// \file
/// The commands of a simulated controller to its joints over time. Radians, meters, nanoseconds of
/// robot time. Manners of Fetch's robot_controllers (melodic-devel): SplineTrajectorySampler,
/// windupTrajectory.
#pragma once

#include <optional>
#include <vector>

#include "nodes/fetch/robot_model.hpp"
#include "nodes/fetch/robot_time.hpp"

namespace afterglow::nodes {

/// Positions that joints pass, all at the same time, or are commanded at a time.
struct JointKnot {
  Nanoseconds time{0};
  std::vector<double> positions, velocities, accelerations;  ///< the last two may be empty
};

class JointPath {
 public:
  JointPath() = default;
  /// Two knots or more, as they come: neither their order in time nor what lies between them is
  /// questioned. Continuous joints take the short way from knot to knot.
  JointPath(std::vector<JointKnot> knots, const std::vector<Joint>& joints);

  /// Degree of interpolation follows what a segment's first knot has: positions a line, velocities
  /// a cubic, accelerations a quintic. After the end, the end; empty before the beginning.
  /// Continuous joints within half a turn of 0.
  std::optional<JointKnot> sample(Nanoseconds now) const;
  Nanoseconds end() const { return knots_.back().time; }

 private:
  std::vector<JointKnot> knots_;
  std::vector<bool> turns_for_ever_;
};

/// The short way from one angle to another, in [-pi, pi].
double turnBetween(double from, double to);

}  // namespace afterglow::nodes
