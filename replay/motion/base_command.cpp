#include "replay/motion/base_command.hpp"

#include <algorithm>

#include "replay/motion/pose_track.hpp"

namespace afterglow::replay {

void BaseCommand::change(const PlanarVelocity& wanted, double seconds) {
  const double step = limits_.acceleration * seconds;
  const double turn_step = limits_.turn_acceleration * seconds;
  const double forward = std::clamp(wanted.forward, -limits_.speed, limits_.speed);
  const double turn = std::clamp(wanted.turn, -limits_.turn_speed, limits_.turn_speed);
  velocity_.forward += std::clamp(forward - velocity_.forward, -step, step);
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
