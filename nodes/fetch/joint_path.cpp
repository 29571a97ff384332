#include "nodes/fetch/joint_path.hpp"

#include <algorithm>
#include <cmath>

#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {
namespace {

struct Boundary {
  double position, velocity, acceleration;
};

/// Position, velocity and acceleration on a line, cubic or quintic through both ends (Hermite; T:
/// the segment's length, t: since its start).
Boundary interpolate(const Boundary& a, const Boundary& b, double T, double t, int degree) {
  if (T == 0) return b;
  const double rise = b.position - a.position;
  if (degree == 1) return {a.position + rise * t / T, rise / T, 0};
  double c[6] = {a.position, a.velocity, 0, 0, 0, 0};
  if (degree == 3) {
    c[2] = (3 * rise - (2 * a.velocity + b.velocity) * T) / (T * T);
    c[3] = (-2 * rise + (a.velocity + b.velocity) * T) / (T * T * T);
  } else {
    c[2] = a.acceleration / 2;
    c[3] = (20 * rise - (8 * b.velocity + 12 * a.velocity) * T -
            (3 * a.acceleration - b.acceleration) * T * T) /
           (2 * std::pow(T, 3));
    c[4] = (-30 * rise + (14 * b.velocity + 16 * a.velocity) * T +
            (3 * a.acceleration - 2 * b.acceleration) * T * T) /
           (2 * std::pow(T, 4));
    c[5] = (12 * rise - 6 * (b.velocity + a.velocity) * T +
            (b.acceleration - a.acceleration) * T * T) /
           (2 * std::pow(T, 5));
  }
  Boundary at{0, 0, 0};
  for (int k = 5; k >= 0; --k) at.position = at.position * t + c[k];
  for (int k = 5; k >= 1; --k) at.velocity = at.velocity * t + k * c[k];
  for (int k = 5; k >= 2; --k) at.acceleration = at.acceleration * t + k * (k - 1) * c[k];
  return at;
}

int degreeFrom(const JointKnot& knot) {
  if (!knot.accelerations.empty()) return 5;
  return knot.velocities.empty() ? 1 : 3;
}

Boundary boundary(const JointKnot& knot, std::size_t joint) {
  const auto at = [&](const std::vector<double>& values) {
    return joint < values.size() ? values[joint] : 0;
  };
  return {knot.positions[joint], at(knot.velocities), at(knot.accelerations)};
}

}  // namespace

double turnBetween(double from, double to) {
  return replay::wrapAngle(to - from);
}

JointPath::JointPath(std::vector<JointKnot> knots, const std::vector<Joint>& joints)
    : knots_(std::move(knots)) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    turns_for_ever_.push_back(joints[i].kind == Joint::Kind::Continuous);
    if (!turns_for_ever_.back()) continue;
    double before = 0;
    for (JointKnot& knot : knots_) {
      knot.positions[i] = before + turnBetween(before, knot.positions[i]);
      before = knot.positions[i];
    }
  }
}

std::optional<JointKnot> JointPath::sample(Nanoseconds now) const {
  // Segment after segment, up to the first that begins later: a knot that lies in the past has been
  // passed, wherever it stands.
  std::size_t begun = 0;
  while (begun + 1 < knots_.size() && knots_[begun].time < now) ++begun;
  if (begun == 0) return std::nullopt;
  const JointKnot &a = knots_[begun - 1], &b = knots_[begun];
  const Nanoseconds at = std::min(now, end());
  const int degree = degreeFrom(a);
  JointKnot found;
  found.time = at;
  for (std::size_t i = 0; i < a.positions.size(); ++i) {
    const Boundary is = interpolate(boundary(a, i), boundary(b, i), seconds(b.time - a.time),
                                    seconds(at - a.time), degree);
    found.positions.push_back(turns_for_ever_[i] ? turnBetween(0, is.position) : is.position);
    if (degree > 1) found.velocities.push_back(is.velocity);
    if (degree > 3) found.accelerations.push_back(is.acceleration);
  }
  return found;
}

}  // namespace afterglow::nodes
