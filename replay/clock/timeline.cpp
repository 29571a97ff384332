#include "replay/clock/timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace afterglow::replay {
namespace {

double checkedRate(double rate) {
  if (const std::string why = whyNoRate(rate); !why.empty()) throw std::logic_error(why);
  return rate;
}

}  // namespace

std::string whyNoRate(double rate) {
  if (rate >= kSlowestRate && rate <= kFastestRate) return "";
  return fmt::format("a rate is {} to {}, not {}", kSlowestRate, kFastestRate, rate);
}

Timeline::Timeline(Stamp begin, double rate, SteadyTime start)
    : begin_(begin), rate_(checkedRate(rate)), anchor_recorded_(begin), anchor_steady_(start) {}

SteadyTime Timeline::deadline(Stamp recorded) const {
  if (is_paused_ || (limit_ && recorded > *limit_)) {
    return SteadyTime::forever();
  }
  const std::int64_t ahead = recorded.ns - anchor_recorded_.ns;
  // At rate 1 whole nanoseconds stay whole: a double holds them for 104 days only.
  return rate_ == 1.0 ? anchor_steady_.after(ahead)
                      : anchor_steady_.after(std::llround(static_cast<double>(ahead) / rate_));
}

Stamp Timeline::recorded(SteadyTime now) const {
  if (is_paused_) {
    return anchor_recorded_;
  }
  const std::int64_t passed = std::max<std::int64_t>(0, now.ns - anchor_steady_.ns);
  const Stamp at{anchor_recorded_.ns +
                 (rate_ == 1.0 ? passed : std::llround(static_cast<double>(passed) * rate_))};
  return limit_ ? std::min(at, *limit_) : at;
}

void Timeline::pause(SteadyTime now) {
  if (!is_paused_) {
    anchor_recorded_ = recorded(now);
    is_paused_ = true;
    paused_at_ = now;
  }
}

void Timeline::resume(SteadyTime now) {
  if (is_paused_) {
    anchor_steady_ = now;
    is_paused_ = false;
    resumed_at_ = now;
    paused_ns_ += now.ns - paused_at_.ns;
  }
}

void Timeline::setRate(double rate, SteadyTime now) {
  const Stamp at = recorded(now);
  rate_ = checkedRate(rate);
  moveTo(at, std::max(now, anchor_steady_));  // a wait for the anchor's moment goes on
}

void Timeline::moveTo(Stamp recorded, SteadyTime when) {
  anchor_recorded_ = recorded;
  anchor_steady_ = when;
}

void Timeline::setLimit(std::optional<Stamp> limit, SteadyTime now) {
  const Stamp at = recorded(now);
  // Only a timeline that stood is anchored anew: one that did not must not drift.
  if (isHeld(now)) moveTo(at, std::max(now, anchor_steady_));
  limit_ = limit ? std::optional(std::max(*limit, at)) : std::nullopt;
}

bool Timeline::isHeld(SteadyTime now) const {
  return !is_paused_ && limit_ && recorded(now) >= *limit_;
}

}  // namespace afterglow::replay
