#include "replay/record/clock_watch.hpp"

#include <fmt/format.h>

#include <utility>

namespace afterglow::replay {
namespace {

constexpr std::int64_t kWallStep = 500'000'000;
constexpr std::int64_t kLeap = 1'000'000'000;
constexpr std::int64_t kFastestSimulation = 10;  // times real time

}  // namespace

std::string secondsText(std::int64_t ns) {
  return fmt::format("{:.3f} s", static_cast<double>(ns) * 1e-9);
}

std::optional<std::string> ClockWatch::look(const ClockReading& now) {
  const std::optional<ClockReading> last = std::exchange(last_, now);
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
