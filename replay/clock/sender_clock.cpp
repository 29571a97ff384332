#include "replay/clock/sender_clock.hpp"

#include <algorithm>
#include <cstdlib>

namespace afterglow::replay {
namespace {

constexpr std::int64_t kSetBack = 1'000'000'000;  // ns; less is a message that was overtaken
constexpr std::int64_t kStep = 50'000'000;        // ns
constexpr std::int64_t kDriftPart = 1000;         // clocks drift by less than so small a part

}  // namespace

std::optional<Stamp> SenderClock::heard(Stamp stamp, Stamp received) {
  const std::int64_t delay_ns = received.ns - stamp.ns;
  const bool begins = count_ == 0 || stamp.ns < stamp_.ns - kSetBack;
  if (!begins && stamp < stamp_) return std::nullopt;
  if (begins || (count_ == 1 && stamp > stamp_)) count_ = begins ? 1 : 2;
  const std::int64_t drift_ns = std::max<std::int64_t>(0, received.ns - received_.ns) / kDriftPart;
  delay_ns_ = begins ? delay_ns : std::min(delay_ns, delay_ns_ + drift_ns);
  stamp_ = stamp;
  received_ = received;
  return Stamp{stamp.ns + delay_ns_};
}

bool ClockStepDetector::hasStepped(Stamp wall, Stamp steady) {
  const std::int64_t apart_ns = wall.ns - steady.ns;
  const bool has_stepped = apart_ns_ && std::abs(apart_ns - *apart_ns_) > kStep;
  apart_ns_ = apart_ns;
  return has_stepped;
}

}  // namespace afterglow::replay
