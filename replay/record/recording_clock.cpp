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
constexpr std::int64_t kFastestSimulation = 10;  // times real time

/// "3.250 s"; never in exponents.
std::string secondsText(std::int64_t ns) {
  return fmt::format("{:.3f} s", static_cast<double>(ns) * 1e-9);
}

}  // namespace

RecordingClock::Given RecordingClock::stamp(Stamp ros, bool is_recording) {
  const Stamp shifted{ros.ns + ahead_ns_};
  const std::int64_t back = last_.ns - shifted.ns;
  if (back <= kSetBack) {
    last_ = std::max(last_, shifted);
    return {last_, std::nullopt};
  }
  went_back_ = true;
  std::string text = "ROS time went back by " + secondsText(back) + " to " + secondsText(ros.ns);
  if (is_recording) {
    ahead_ns_ += back;
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
  // From 0 on: the simulation's first word.
  const std::int64_t leap = now.ros.ns - last->ros.ns;
  if (now.is_simulated && last->ros.ns != 0 && leap > kLeap + kFastestSimulation * passed) {
    return "/clock leapt ahead by " + secondsText(leap) + " at " + secondsText(last->ros.ns);
  }
  return std::nullopt;
}

}  // namespace afterglow::replay
