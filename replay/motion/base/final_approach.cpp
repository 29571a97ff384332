#include "replay/motion/base/final_approach.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

constexpr double kTurned = 0.003;   // rad
constexpr double kArrived = 0.001;  // m
constexpr double kLearned = 0.001;  // of an error: a smaller change does not count
constexpr double kGain = 2.5;       // 1/s, for the very end of a move

/// Fast, but slow enough to brake in time.
double speedFor(double left, double fastest, double braking) {
  const double length = std::abs(left);
  return std::copysign(std::min({fastest, std::sqrt(braking * length), kGain * length}), left);
}

}  // namespace

ApproachOptions approachOfStart() {
  ApproachOptions options;
  options.tolerance = options.wanted_error = 0.02;
  options.beside = 0.035;
  options.turn_tolerance = options.wanted_turn_error = 0.02;
  return options;
}

void FinalApproach::enter(Phase phase) {
  phase_ = phase;
  in_phase_ = 0;
}

std::optional<PlanarVelocity> FinalApproach::step(const PlanarPose& base, double position_error,
                                                  double turn_error, double seconds) {
  in_phase_ += seconds;
  unchanged_ += seconds;
  if (std::abs(position_error - known_) > kLearned * known_) {
    known_ = position_error;
    unchanged_ = 0;
  }
  if (phase_ != Phase::Stand && in_phase_ > options_.longest_move) enter(Phase::Stand);
  switch (phase_) {
    case Phase::Stand:
      if (isWorthWaiting(position_error, turn_error)) return PlanarVelocity{};
      if (!look(base)) return {};
      return PlanarVelocity{};
    case Phase::Turn:
      return turnTo(base, heading_, Phase::Drive);
    case Phase::Drive:
      return drive(base);
    case Phase::TurnBack:
      return turnTo(base, goal_.yaw, Phase::Stand);
    case Phase::Slide:
      return slide(base);
  }
  return {};
}

bool FinalApproach::isWorthWaiting(double position_error, double turn_error) const {
  if (in_phase_ < options_.shortest_stand) return true;
  if (in_phase_ >= options_.longest_stand || unchanged_ >= options_.longest_unchanged) return false;
  return position_error > options_.wanted_error || turn_error > options_.wanted_turn_error;
}

/// Begins a move if one is needed and allowed.
bool FinalApproach::look(const PlanarPose& base) {
  const PlanarPose left = between(base, goal_);
  const double length = std::hypot(left.x, left.y);
  const bool is_beside = std::abs(left.y) <= options_.beside;
  const bool is_there =
      length <= options_.tolerance || (is_beside && std::abs(left.x) <= options_.tolerance);
  const bool may_back_up = !avoids_unseen_ || length <= kUnseenWay;
  const bool is_turned = std::abs(left.yaw) <= options_.turn_tolerance;
  if ((is_there && is_turned) || attempts_ >= options_.most_attempts) return false;
  if (is_holonomic_) {
    is_left_aside_ = !may_back_up;
    if (is_left_aside_) return false;
    enter(Phase::Slide);
    ++attempts_;
    return true;
  }
  heading_ = base.yaw;
  const bool may_drive = left.x >= 0 || may_back_up;
  const auto turn = turnToDrive(base, may_back_up);
  if (is_there) {
    enter(Phase::TurnBack);
  } else if (is_beside && may_drive) {
    enter(Phase::Drive);
  } else if (turn) {
    heading_ = wrapAngle(base.yaw + *turn);
    enter(Phase::Turn);
  } else if (may_drive && isWorthDrivingBeside(base, may_back_up)) {
    enter(Phase::Drive);
  } else {
    is_left_aside_ = true;
    if (is_turned) return false;
    enter(Phase::TurnBack);
  }
  ++attempts_;
  return true;
}

/// Returns true if it is worth going straight to beside the goal: it is far from there, or may turn
/// to the goal there.
bool FinalApproach::isWorthDrivingBeside(const PlanarPose& base, bool may_back_up) const {
  const double way = between(base, goal_).x;
  if (std::abs(way) > options_.tolerance) return true;
  return std::abs(way) > kArrived && turnToDrive(alongArc(base, way, 0), may_back_up);
}

/// The smallest turn after which the goal lies straight ahead or behind; empty: it may do none.
std::optional<double> FinalApproach::turnToDrive(const PlanarPose& base, bool may_back_up) const {
  const PlanarPose left = between(base, goal_);
  const double bearing = std::atan2(left.y, left.x), turned = wrapAngle(base.yaw - goal_.yaw);
  const auto mayTurn = [&](double turn) {
    return turned + turn >= headings_.from - options_.unrecorded_turn &&
           turned + turn <= headings_.to + options_.unrecorded_turn;
  };
  const double behind = wrapAngle(bearing + kPi);
  const bool may_ahead = mayTurn(bearing), may_behind = may_back_up && mayTurn(behind);
  if (may_behind && (!may_ahead || std::abs(behind) < std::abs(bearing))) return behind;
  return may_ahead ? std::optional(bearing) : std::nullopt;
}

PlanarVelocity FinalApproach::turnTo(const PlanarPose& base, double yaw, Phase next) {
  const double left = wrapAngle(yaw - base.yaw);
  if (std::abs(left) < kTurned) {
    enter(next);
    return {};
  }
  return {0, speedFor(left, options_.turn_speed, options_.turn_acceleration)};
}

PlanarVelocity FinalApproach::slide(const PlanarPose& base) {
  const PlanarPose left = between(base, goal_);
  const double length = std::hypot(left.x, left.y);
  const bool is_turned = std::abs(left.yaw) < kTurned;
  if (length < kArrived && is_turned) {
    enter(Phase::Stand);
    return {};
  }
  const double turn =
      is_turned ? 0 : speedFor(left.yaw, options_.turn_speed, options_.turn_acceleration);
  if (length < kArrived) return {0, turn};
  const double share = speedFor(length, options_.speed, options_.acceleration) / length;
  return {share * left.x, turn, share * left.y};
}

PlanarVelocity FinalApproach::drive(const PlanarPose& base) {
  const double left =
      (goal_.x - base.x) * std::cos(heading_) + (goal_.y - base.y) * std::sin(heading_);
  if (std::abs(left) < kArrived) {
    enter(Phase::TurnBack);
    return {};
  }
  return {speedFor(left, options_.speed, options_.acceleration),
          kGain * wrapAngle(heading_ - base.yaw)};
}

}  // namespace afterglow::replay
