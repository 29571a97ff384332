#include "replay/motion/base/base_command.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::replay {
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
