#include "replay/motion/arm/arm_path.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "replay/messages/ranges.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {
namespace {

constexpr double kFarthestBefore = 10, kFarthestAfter = 0.5;  // s
constexpr double kFindEvery = 0.01;                           // s
constexpr std::size_t kMostLooks = 2000;
/// The weight of a second away from the expected moment, in tolerances: of the moments of a stand
/// the nearest is meant.
constexpr double kAwayCounts = 0.05;
constexpr double kRampStep = 0.05;     // s between the knots of a ramp
constexpr double kNearestKnots = 2e-3;  // s; of nearer ones one is left
/// An end that is reached before joints are on the path is gone to directly, in this time or more.
constexpr double kShortestSettle = 0.2;

JointMotion stateOf(const ArmKnot& knot, std::size_t joint) {
  const auto of = [joint](const std::vector<double>& numbers) {
    return joint < numbers.size() ? numbers[joint] : 0;
  };
  return {knot.positions[joint], of(knot.velocities), of(knot.accelerations)};
}

int degreeOf(const ArmKnot& knot) {
  const std::size_t size = knot.positions.size();
  if (knot.velocities.size() != size) return 1;
  return knot.accelerations.size() == size ? 5 : 3;
}

/// Returns where a function is least that falls, and rises from there.
template <typename Function>
double leastBetween(double low, double high, const Function& value) {
  for (int i = 0; i < 50; ++i) {
    const double third = (high - low) / 3;
    if (value(low + third) < value(high - third)) {
      high -= third;
    } else {
      low += third;
    }
  }
  return (low + high) / 2;
}

}  // namespace

// -------------------------------------------------------------------------------------- the path

JointMotion interpolate(const JointMotion& a, const JointMotion& b, double T, double t,
                        int degree) {
  if (T == 0) return b;
  const double rise = b.position - a.position;
  if (degree == 1) return {a.position + rise * t / T, rise / T, 0};
  double c[6] = {a.position, a.velocity, 0, 0, 0, 0};
  if (degree == 3) {
    c[2] = (3 * rise - (2 * a.velocity + b.velocity) * T) / (T * T);
    c[3] = (-2 * rise + (a.velocity + b.velocity) * T) / (T * T * T);
  } else {
    // What is left for the three upper powers at the end.
    const double p = rise - a.velocity * T - a.acceleration * T * T / 2;
    const double v = (b.velocity - a.velocity) * T - a.acceleration * T * T;
    const double w = (b.acceleration - a.acceleration) * T * T;
    c[2] = a.acceleration / 2;
    c[3] = (10 * p - 4 * v + w / 2) / std::pow(T, 3);
    c[4] = (-15 * p + 7 * v - w) / std::pow(T, 4);
    c[5] = (6 * p - 3 * v + w / 2) / std::pow(T, 5);
  }
  JointMotion at;
  for (int k = 5; k >= 0; --k) at.position = at.position * t + c[k];
  for (int k = 5; k >= 1; --k) at.velocity = at.velocity * t + k * c[k];
  for (int k = 5; k >= 2; --k) at.acceleration = at.acceleration * t + k * (k - 1) * c[k];
  return at;
}

ArmPath::ArmPath(std::vector<ArmKnot> knots, std::vector<bool> is_continuous)
    : knots_(std::move(knots)), is_continuous_(std::move(is_continuous)) {
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    degree_ = std::min(degree_, degreeOf(knots_[k]));
    for (std::size_t i = 0; k > 0 && i < knots_[k].positions.size(); ++i) {
      const double before = knots_[k - 1].positions[i];
      double& position = knots_[k].positions[i];
      if (is_continuous_[i]) position = before + way(i, before, position);
    }
  }
}

double ArmPath::way(std::size_t joint, double from, double to) const {
  return is_continuous_[joint] ? wrapAngle(to - from) : to - from;
}

ArmKnot ArmPath::at(double seconds) const {
  const std::size_t joints = knots_.front().positions.size();
  const auto after =
      std::find_if(knots_.begin(), knots_.end(),
                   [seconds](const ArmKnot& knot) { return knot.at_s > seconds; });
  ArmKnot found{seconds, {}, std::vector<double>(joints), std::vector<double>(joints)};
  if (after == knots_.begin() || (after == knots_.end() && seconds > endSeconds())) {
    found.positions = (after == knots_.begin() ? knots_.front() : knots_.back()).positions;
    return found;
  }
  if (knots_.size() == 1) {
    found.positions = knots_.front().positions;
    return found;
  }
  // Its last moment belongs to the last segment.
  const ArmKnot& b = after == knots_.end() ? knots_.back() : *after;
  const ArmKnot& a = *(&b - 1);
  const double length = b.at_s - a.at_s;
  for (std::size_t i = 0; i < joints; ++i) {
    const JointMotion is =
        interpolate(stateOf(a, i), stateOf(b, i), length, seconds - a.at_s, degree_);
    found.positions.push_back(is.position);
    found.velocities[i] = is.velocity;
    found.accelerations[i] = is.acceleration;
  }
  return found;
}

/// The joint that is farthest from there, in tolerances.
double ArmPath::farthest(double seconds, const std::vector<double>& positions,
                         const std::vector<double>& tolerances) const {
  const ArmKnot there = at(seconds);
  double most = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    most = std::max(most, std::abs(way(i, there.positions[i], positions[i])) / tolerances[i]);
  }
  return most;
}

std::optional<double> ArmPath::find(const std::vector<double>& positions,
                                    const std::vector<double>& tolerances,
                                    double around_s) const {
  const double least = std::max(beginSeconds(), around_s - kFarthestBefore);
  const double most = std::min(endSeconds(), around_s + kFarthestAfter);
  if (!(most >= least)) {
    return std::nullopt;
  }
  const auto looks = std::min<std::size_t>(
      kMostLooks, static_cast<std::size_t>(std::ceil((most - least) / kFindEvery)) + 1);
  // The best moment of the stretch that is under way, and of the nearest one so far.
  std::optional<double> best, found;
  double best_counts = 0, best_away = 0, found_away = 0;
  const auto countsAt = [&](double seconds) {
    return farthest(seconds, positions, tolerances) + kAwayCounts * std::abs(seconds - around_s);
  };
  const auto endStretch = [&] {
    if (best && (!found || best_away < found_away)) {
      found = best;
      found_away = best_away;
    }
    best.reset();
  };
  for (std::size_t k = 0; k <= looks; ++k) {
    const double s =
        least + (most - least) * static_cast<double>(k) / static_cast<double>(looks);
    const double away = std::abs(s - around_s), counts = countsAt(s);
    if (counts - kAwayCounts * away > 1) {
      endStretch();
      continue;
    }
    best_away = best ? std::min(best_away, away) : away;
    if (!best || counts < best_counts) {
      best = s;
      best_counts = counts;
    }
  }
  endStretch();
  if (!found) {
    return std::nullopt;
  }
  return leastBetween(std::max(least, *found - kFindEvery), std::min(most, *found + kFindEvery),
                      countsAt);
}

// --------------------------------------------------------------------------------- the departure

namespace {

/// A ramp from one pace to the path's, smooth at both ends.
class Ramp {
 public:
  Ramp(const ArmPath& path, const ArmDeparture& departure) : path_(path), by_(departure) {}

  /// The moment of the path after so long.
  double pathSeconds(double seconds) const {
    if (seconds >= by_.ramp_s) return by_.from_s + seconds - by_.lostSeconds();
    const double x = seconds / by_.ramp_s;
    const double gained = by_.pace * x + (1 - by_.pace) * (x * x * x - x * x * x * x / 2);
    return by_.from_s + by_.ramp_s * gained;
  }
  /// The inverse.
  double secondsTo(double path_seconds) const {
    double least = 0, most = std::max(0.0, path_seconds - by_.from_s) + by_.ramp_s;
    for (int i = 0; i < 60; ++i) {
      const double middle = (least + most) / 2;
      (pathSeconds(middle) < path_seconds ? least : most) = middle;
    }
    return most;
  }
  ArmKnot at(double seconds) const;

 private:
  const ArmPath& path_;
  const ArmDeparture& by_;
};

ArmKnot Ramp::at(double seconds) const {
  const double x = by_.ramp_s > 0 ? std::min(seconds / by_.ramp_s, 1.0) : 1.0;
  const double pace = by_.pace + (1 - by_.pace) * x * x * (3 - 2 * x);
  const double push = by_.ramp_s > 0 ? (1 - by_.pace) * 6 * x * (1 - x) / by_.ramp_s : 0;
  const double y = by_.blend_s > 0 ? std::min(seconds / by_.blend_s, 1.0) : 1.0;
  ArmKnot knot = path_.at(std::min(pathSeconds(seconds), path_.endSeconds()));
  knot.at_s = seconds;
  for (std::size_t i = 0; i < knot.positions.size(); ++i) {
    const double off = i < by_.offsets.size() ? by_.offsets[i] : 0;
    const double b = by_.blend_s > 0 ? by_.blend_s : 1;
    // Fades without a push at either end.
    knot.positions[i] += off * (1 - y * y * y * (10 - 15 * y + 6 * y * y));
    knot.accelerations[i] = knot.accelerations[i] * pace * pace + knot.velocities[i] * push -
                            off * 60 * y * (1 - y) * (1 - 2 * y) / (b * b);
    knot.velocities[i] =
        knot.velocities[i] * pace - off * 30 * y * y * (1 - y) * (1 - y) / b;
  }
  return knot;
}

/// Returns when the knots come: those of the path, and others where they are not as the path has
/// them.
std::vector<double> timesOf(const ArmPath& path, const ArmDeparture& departure, const Ramp& ramp) {
  std::vector<double> times;
  for (const ArmKnot& knot : path.knots()) {
    const double seconds = ramp.secondsTo(knot.at_s);
    if (seconds >= kNearestKnots) times.push_back(seconds);
  }
  const double length =
      std::min(times.back(), std::max(departure.ramp_s, departure.blend_s));
  const int count = std::max(1, static_cast<int>(std::ceil(length / kRampStep)));
  for (int k = 0; k <= count; ++k) {
    const double at = length * k / count;
    const auto isThere = [at](double other) { return std::abs(other - at) < kNearestKnots; };
    if (!anyOf(times, isThere)) times.push_back(at);
  }
  std::sort(times.begin(), times.end());
  return times;
}

/// The path's end is so near that it is gone to directly.
std::vector<ArmKnot> settle(const ArmPath& path, const ArmDeparture& departure) {
  const Ramp ramp(path, departure);
  ArmKnot begin = ramp.at(0), end = path.knots().back();
  std::fill(begin.velocities.begin(), begin.velocities.end(), 0);
  std::fill(begin.accelerations.begin(), begin.accelerations.end(), 0);
  end.velocities = begin.velocities;
  end.accelerations = begin.accelerations;
  end.at_s = std::max({kShortestSettle, departure.blend_s, departure.ramp_s / 2});
  return {begin, end};
}

}  // namespace

std::vector<ArmKnot> depart(const ArmPath& path, const ArmDeparture& departure) {
  const Ramp ramp(path, departure);
  const double end = ramp.secondsTo(path.endSeconds());
  if (end < std::max(kShortestSettle, departure.blend_s)) return settle(path, departure);
  std::vector<ArmKnot> knots;
  for (const double seconds : timesOf(path, departure, ramp)) {
    knots.push_back(ramp.at(seconds));
    // On the path again its own knots are the recorded ones, to the last bit of their speed.
    const auto own = std::find_if(path.knots().begin(), path.knots().end(), [&](const auto& knot) {
      return std::abs(knot.at_s - ramp.pathSeconds(seconds)) < 1e-6;
    });
    const bool is_over = seconds >= std::max(departure.ramp_s, departure.blend_s);
    if (is_over && own != path.knots().end() && path.hasVelocities()) {
      knots.back().positions = own->positions;
      knots.back().velocities = own->velocities;
      if (path.hasAccelerations()) knots.back().accelerations = own->accelerations;
    }
  }
  return knots;
}

}  // namespace afterglow::replay
