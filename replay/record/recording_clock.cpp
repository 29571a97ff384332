#include "replay/record/recording_clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace afterglow::replay {
namespace {

/// Less is evened out: threads that take stamps at once and are held up, a disciplined clock.
constexpr std::int64_t kSetBack = 500'000'000;
constexpr std::int64_t kWallStep = 500'000'000;
constexpr std::int64_t kLeap = 1'000'000'000;
constexpr std::int64_t kStands = 5'000'000'000;
constexpr std::int64_t kFastestSimulation = 10;  // times real time

/// "3.250 s"; never in exponents.
std::string secondsText(std::int64_t ns) {
  return fmt::format("{:.3f} s", static_cast<double>(ns) * 1e-9);
}

}  // namespace

/// Returns by how much ROS time went ahead of the steady clock since the last call.
std::optional<std::int64_t> RecordingClock::leapOf(Stamp ros, std::int64_t steady_ns) {
  const std::int64_t now = ros.ns - steady_ns;
  const std::int64_t leap = now - ros_by_steady_ns_.value_or(now);
  if (leap < -kWallStep) {
    // A thread that is held up between its two looks sees it so once, a clock that was set back
    // always.
    const auto before = std::exchange(lower_ns_, now);
    if (before) ros_by_steady_ns_ = std::max(*before, now);
    return std::nullopt;
  }
  lower_ns_.reset();
  ros_by_steady_ns_ = std::max(now, ros_by_steady_ns_.value_or(now));
  return leap > kWallStep ? std::optional(leap) : std::nullopt;
}

RecordingClock::Given RecordingClock::stamp(Stamp ros, bool is_recording,
                                            std::optional<std::int64_t> steady_ns) {
  const auto leap = steady_ns ? leapOf(ros, *steady_ns) : std::nullopt;
  if (leap && is_recording) {
    ahead_ns_ -= *leap;
    last_ = std::max(last_, Stamp{ros.ns + ahead_ns_});
    return {last_, "ROS time was set ahead by " + secondsText(*leap) + " to " +
                       secondsText(ros.ns) + "; stamps of this recording go on as before"};
  }
  const Stamp shifted{ros.ns + ahead_ns_};
  if (last_.ns - shifted.ns <= kSetBack) {
    last_ = std::max(last_, shifted);
    return {last_, std::nullopt};
  }
  went_back_ = true;
  Stamp next = last_;
  if (is_recording && steady_ns) {
    next = std::max(next, Stamp{*steady_ns + *ros_by_steady_ns_ + ahead_ns_});
  }
  const std::int64_t back = next.ns - shifted.ns;
  std::string text = "ROS time went back by " + secondsText(back) + " to " + secondsText(ros.ns);
  if (is_recording) {
    ahead_ns_ += back;
    last_ = next;
    text +=
        "; from then on stamps of this recording are " + secondsText(ahead_ns_) + " ahead of it";
  } else {
    last_ = ros;
  }
  return {last_, text};
}

bool RecordingClock::endRecording() {
  const std::int64_t ahead_ns = std::exchange(ahead_ns_, 0);
  last_.ns -= ahead_ns;
  return ahead_ns != 0;
}

std::optional<std::string> RecordingClock::look(const ClockReading& now) {
  const std::optional<ClockReading> last = std::exchange(last_reading_, now);
  if (!last) return std::nullopt;
  const std::int64_t passed = now.steady_ns - last->steady_ns;
  const std::int64_t wall_step = now.wall.ns - last->wall.ns - passed;
  if (wall_step > kWallStep || wall_step < -kWallStep) {
    return "the wall clock was set " + std::string(wall_step > 0 ? "ahead" : "back") + " by " +
           secondsText(wall_step > 0 ? wall_step : -wall_step) + " at " +
           secondsText(last->wall.ns) + " of its time";
  }
  const bool stands = now.is_simulated && now.ros == last->ros;
  standing_ns_ = stands ? standing_ns_ + passed : 0;
  if (standing_ns_ >= kStands && standing_ns_ - passed < kStands) {
    return "/clock has stood still for 5 s at " + secondsText(now.ros.ns) +
           ": all that comes has this stamp";
  }
  // From 0 on: the simulation's first word.
  const std::int64_t leap = now.ros.ns - last->ros.ns;
  if (now.is_simulated && last->ros.ns != 0 && leap > kLeap + kFastestSimulation * passed) {
    return "/clock leapt ahead by " + secondsText(leap) + " at " + secondsText(last->ros.ns);
  }
  return std::nullopt;
}

}  // namespace afterglow::replay
