#include "replay/motion/base/base_obedience.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "replay/messages/ranges.hpp"

namespace afterglow::replay {
namespace {

constexpr double kMeasuredOver = 0.2;   // s over which velocities are measured
constexpr double kLongestGap = 1.0;  // s between poses: what was meanwhile is not known
/// A base that hears nothing has stopped by itself, whatever it was.
constexpr double kHolds = 1.0;  // s
/// Speeds that are no motion, m/s and rad/s, and those that a base on the floor does not resist.
constexpr double kStands = 0.02, kStandsTurn = 0.03;
constexpr double kIsToMove = 0.08, kIsToTurn = 0.25;

}  // namespace

void BaseObedience::told(Stamp now, const Velocity& velocity) {
  if (!told_.empty() && now < told_.back().at) told_.clear();  // a clock that was set back
  told_.push_back({now, {velocity[0], velocity[1], velocity[5]}});
}

/// Measures by the base's own clock, over the last moments; of an arc the chord's middle points
/// ahead.
std::optional<BaseObedience::Motion> BaseObedience::measure(Stamp stamp, const PlanarPose& pose) {
  if (!seen_.empty()) {
    const double gap = secondsBetween(seen_.back().stamp, stamp);
    if (gap < 0 || gap > kLongestGap) seen_.clear();
  }
  seen_.push_back({stamp, pose});
  while (seen_.size() > 2 && secondsBetween(seen_[1].stamp, stamp) >= kMeasuredOver) {
    seen_.pop_front();
  }
  const double seconds = secondsBetween(seen_.front().stamp, stamp);
  if (seconds < kMeasuredOver / 2) return std::nullopt;
  const PlanarPose way = between(seen_.front().pose, pose);
  const double c = std::cos(way.yaw / 2), s = std::sin(way.yaw / 2);
  return Motion{(c * way.x + s * way.y) / seconds, (c * way.y - s * way.x) / seconds,
                way.yaw / seconds};
}

/// Moves the bounds: what was told within the latency, standing, and what is left of more than
/// that.
void BaseObedience::moveBounds(Stamp now) {
  const std::int64_t latency_ns = static_cast<std::int64_t>(options_.latency * 1e9);
  while (told_.size() > 1 && told_[1].at.ns <= now.ns - latency_ns) told_.pop_front();
  const double elapsed = std::max(0.0, secondsBetween(bounded_, now));
  bounded_ = now;
  for (std::size_t i = 0; i < most_.size(); ++i) {
    const double lost = elapsed * (i == 2 ? options_.turn_deceleration : options_.deceleration);
    double most = 0, least = 0;
    for (const Told& told : told_) {
      if (secondsBetween(told.at, now) > kHolds + options_.latency) continue;
      most = std::max(most, told.motion[i]);
      least = std::min(least, told.motion[i]);
    }
    most_[i] = std::max(most, most_[i] - lost);
    least_[i] = std::min(least, least_[i] + lost);
  }
}

bool BaseObedience::isFaster(const Motion& motion) const {
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const double tolerance = i == 2 ? options_.turn_tolerance : options_.tolerance;
    const double above = motion[i] - most_[i] - options_.share * most_[i];
    const double below = least_[i] + options_.share * least_[i] - motion[i];
    if (std::max(above, below) > tolerance) return true;
  }
  return false;
}

bool BaseObedience::isTooLong(std::optional<Stamp>& since, bool holds, double patience,
                              Stamp now) const {
  if (!holds || (since && now < *since)) since.reset();
  if (holds && !since) since = now;
  return since && secondsBetween(*since, now) >= patience;
}

std::string BaseObedience::moved(Stamp now, Stamp stamp, const PlanarPose& pose) {
  const std::optional<Motion> motion = measure(stamp, pose);
  moveBounds(now);
  if (!motion) return "";
  const Motion told = told_.empty() ? Motion{} : told_.back().motion;
  if (isTooLong(faster_since_, isFaster(*motion), options_.patience, now)) {
    return fmt::format(
        "the base moves otherwise than told: {:.2f} m/s and {:.2f} rad/s instead of {:.2f} and "
        "{:.2f}",
        std::hypot((*motion)[0], (*motion)[1]), (*motion)[2], std::hypot(told[0], told[1]),
        told[2]);
  }
  const auto moves = [](const Motion& of, double linear, double turn) {
    return std::hypot(of[0], of[1]) >= linear || std::abs(of[2]) >= turn;
  };
  const bool is_told =
      !told_.empty() &&
      allOf(told_, [&](const Told& each) { return moves(each.motion, kIsToMove, kIsToTurn); });
  const bool stands = is_told && !moves(*motion, kStands, kStandsTurn);
  if (isTooLong(stands_since_, stands, options_.standing_patience, now)) {
    return fmt::format("the base stands, though it is told to move, {:.2f} m/s and {:.2f} rad/s",
                       std::hypot(told[0], told[1]), told[2]);
  }
  return "";
}

}  // namespace afterglow::replay
