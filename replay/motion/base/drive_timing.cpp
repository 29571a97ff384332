#include "replay/motion/base/drive_timing.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "replay/motion/pose_track.hpp"

namespace afterglow::replay {
namespace {

constexpr double kTimingStep = 0.05;                        // s
constexpr double kShownOver = 0.2;                          // s
constexpr double kSlowest = 0.01;                           // m/s, of a base that does not rest
constexpr double kReaction = 0.15;                          // s
constexpr double kLeastShown = 0.2, kLeastTurnShown = 0.5;  // m/s^2, rad/s^2

/// The fastest pace p at a node of recorded speed v, from which a step of recorded time leads to a
/// node that is passed at `beside_speed` and `beside_pace`, with a change of speed that a ramp
/// allows: (v p - beside_speed) (p + beside_pace) / 2 <= ramp * step.
double paceBeside(double v, double beside_speed, double beside_pace, double ramp, double step) {
  const double b = v * beside_pace - beside_speed;
  const double c = beside_speed * beside_pace + 2 * ramp * step;
  return (std::sqrt(b * b + 4 * v * c) - b) / (2 * v);
}

}  // namespace

DriveLimits shownBy(const PoseTrack& track) {
  DriveLimits shown;
  shown.acceleration = kLeastShown;
  shown.turn_acceleration = kLeastTurnShown;
  // A track that ends in motion does not show that its base can stand at once.
  for (Stamp at = track.begin(); later(at, kShownOver) < track.end(); at = later(at, kTimingStep)) {
    const PlanarVelocity from = track.velocityAt(at), to = track.velocityAt(later(at, kShownOver));
    const double change = std::abs(to.speed() - from.speed());
    const double turn_change = std::abs(std::abs(to.turn) - std::abs(from.turn));
    shown.acceleration = std::max(shown.acceleration, change / kShownOver);
    shown.turn_acceleration = std::max(shown.turn_acceleration, turn_change / kShownOver);
  }
  return shown;
}

DriveTiming::DriveTiming(const PoseTrack& track, const DriveLimits& limits, double rate)
    : begin_(track.begin()),
      linear_ramp_(kPlannedShare * limits.acceleration),
      angular_ramp_(limits.turn_acceleration) {
  for (const double value :
       {limits.speed, limits.turn_speed, limits.acceleration, limits.turn_acceleration}) {
    if (!(value > 0)) throw std::invalid_argument("the limits of a base must be above zero");
  }
  if (!(rate > 0)) throw std::invalid_argument("the rate of a base must be above zero");
  measure(track);
  for (Node& node : nodes_) {
    node.pace = rate;
    if (node.speed * node.pace > limits.speed) node.pace = limits.speed / node.speed;
    if (node.turn * node.pace > limits.turn_speed) node.pace = limits.turn_speed / node.turn;
  }
  for (std::size_t i = nodes_.size() - 1; i-- > 0;) {
    slowDown(nodes_[i], nodes_[i + 1]);
    const double step = step_ * (nodes_[i].speed + nodes_[i + 1].speed) / 2;
    nodes_[i].way = nodes_[i].speed > kSlowest || i == 0 ? nodes_[i + 1].way + step : 0;
  }
  for (std::size_t i = 1; i < nodes_.size(); ++i) slowDown(nodes_[i], nodes_[i - 1]);
  // At the ends it stands, at whatever pace; between them and the next node it is no faster.
  nodes_.front().pace = nodes_[1].pace;
  nodes_.back().pace = nodes_[nodes_.size() - 2].pace;
  for (const Node& node : nodes_) fastest_ = std::max(fastest_, node.speed * node.pace);
}

/// Measures the track's speeds, smoothed over a few steps.
void DriveTiming::measure(const PoseTrack& track) {
  const double length = secondsBetween(track.begin(), track.end());
  const auto steps = std::max<std::size_t>(2, static_cast<std::size_t>(length / kTimingStep));
  step_ = std::max(length, 1e-3) / static_cast<double>(steps);
  nodes_.resize(steps + 1);
  std::vector<PlanarVelocity> velocities;
  for (std::size_t i = 0; i <= steps; ++i) {
    velocities.push_back(track.velocityAt(later(begin_, step_ * static_cast<double>(i))));
  }
  for (std::size_t i = 1; i < steps; ++i) {
    const PlanarVelocity &a = velocities[i - 1], &b = velocities[i], &c = velocities[i + 1];
    const bool turns_back = a.forward * c.forward + a.left * c.left < 0;
    const double forward = a.forward + 2 * b.forward + c.forward;
    const double left = a.left + 2 * b.left + c.left;
    nodes_[i].speed = turns_back ? 0 : std::hypot(forward, left) / 4;
    nodes_[i].turn = std::abs(a.turn + 2 * b.turn + c.turn) / 4;
  }
}

void DriveTiming::slowDown(Node& node, const Node& beside) const {
  const auto slow = [&](double v, double v_beside, double ramp) {
    if (v == 0) return;
    const double pace = paceBeside(v, v_beside * beside.pace, beside.pace, ramp, step_);
    node.pace = std::min(node.pace, pace);
  };
  slow(node.speed, beside.speed, linear_ramp_);
  slow(node.turn, beside.turn, angular_ramp_);
}

double DriveTiming::at(Stamp stamp, double Node::*value) const {
  const double last = static_cast<double>(nodes_.size() - 1);
  const double place = std::clamp(secondsBetween(begin_, stamp) / step_, 0., last);
  const auto i = std::min(static_cast<std::size_t>(place), nodes_.size() - 2);
  const double share = place - static_cast<double>(i);
  return nodes_[i].*value + share * (nodes_[i + 1].*value - nodes_[i].*value);
}

double DriveTiming::paceAt(Stamp stamp) const { return at(stamp, &Node::pace); }

double DriveTiming::wayToRest(Stamp stamp) const { return at(stamp, &Node::way); }

/// So fast that v t + v^2 / 2a is no more than the way.
double DriveTiming::speedFor(double way) const {
  const double lost = linear_ramp_ * kReaction;
  return std::sqrt(lost * lost + 2 * linear_ramp_ * std::max(0., way)) - lost;
}

double DriveTiming::seconds() const {
  double seconds = 0;
  for (std::size_t i = 1; i < nodes_.size(); ++i) {
    seconds += 2 * step_ / (nodes_[i - 1].pace + nodes_[i].pace);
  }
  return seconds;
}

namespace {

constexpr double kHurry = 1.05;  // to catch up with the timeline

void checkRate(double rate) {
  if (!(rate > 0)) throw std::invalid_argument("the rate of a base must be above zero");
}

}  // namespace

PathTime::PathTime(Stamp begin, Stamp end, double rate)
    : now_(begin), end_(end), rate_(rate), pace_(rate) {
  checkRate(rate);
}

Stamp PathTime::in(double seconds) const { return later(now_, pace_ * seconds); }

void PathTime::advance(double seconds) {
  Stamp next = in(seconds);
  if (met_ && next < *met_) next = std::min(*met_, in(kHurry * seconds));
  now_ = std::min({next, end_, std::max(now_, limit_.value_or(end_))});
}

void PathTime::setRate(double rate) {
  checkRate(rate);
  pace_ *= rate / rate_;
  rate_ = rate;
}

namespace {

/// Returns the share of a wanted speed that a limit allows.
double shareOf(double limit, double wanted) { return wanted > limit ? limit / wanted : 1; }

}  // namespace

void BaseCommand::change(const PlanarVelocity& wanted, double seconds) {
  const double step = limits_.acceleration * seconds;
  const double turn_step = limits_.turn_acceleration * seconds;
  const double slower = shareOf(limits_.speed, wanted.speed());
  const double forward = wanted.forward * slower - velocity_.forward;
  const double left = wanted.left * slower - velocity_.left;
  const double share = shareOf(step, std::hypot(forward, left));
  const double turn = std::clamp(wanted.turn, -limits_.turn_speed, limits_.turn_speed);
  velocity_.forward += forward * share;
  velocity_.left += left * share;
  velocity_.turn += std::clamp(turn - velocity_.turn, -turn_step, turn_step);
}

PlanarVelocity BaseCommand::send(Stamp now) {
  sent_.push_back({now, velocity_});
  // The command in effect at the oldest odometry that counts is kept.
  const Stamp oldest = later(now, -limits_.delay - limits_.longest_silence);
  while (sent_.size() > 1 && sent_[1].at < oldest) sent_.pop_front();
  return velocity_;
}

PlanarPose BaseCommand::predict(PlanarPose base, Stamp from, Stamp to) const {
  PlanarVelocity velocity;
  Stamp at = from;
  for (const Sent& sent : sent_) {
    const Stamp effect = std::min(later(sent.at, limits_.delay), to);
    if (effect > at) {
      base = advance(base, velocity, secondsBetween(at, effect));
      at = effect;
    }
    velocity = sent.velocity;
  }
  return to > at ? advance(base, velocity, secondsBetween(at, to)) : base;
}

}  // namespace afterglow::replay
