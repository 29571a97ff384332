#include "replay/motion/silence_monitor.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

/// Intervals that show a period.
constexpr std::size_t kFewestIntervals = 4;
/// The longest of them, in periods, of what still counts as periodic.
constexpr double kRegular = 2.5;
constexpr std::int64_t kMissed = 5;  // periods: four messages, and the next is due

}  // namespace

void SilenceMonitor::heard(SteadyTime now) {
  if (last_ && now == *last_) return;
  if (last_ && now < *last_) *this = SilenceMonitor(bounds_);
  if (last_) {
    intervals_[count_++ % kMostIntervals] = now.ns - last_->ns;
    measurePeriod();
  }
  last_ = now;
}

/// The median: a message that is late, or two that come together, do not change it.
void SilenceMonitor::measurePeriod() {
  if (count_ < kFewestIntervals) return;
  std::array<std::int64_t, kMostIntervals> sorted = intervals_;
  const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(std::min(count_, kMostIntervals));
  const auto middle = sorted.begin() + (end - sorted.begin()) / 2;
  std::nth_element(sorted.begin(), middle, end);
  const bool is_regular = static_cast<double>(*std::max_element(middle, end)) <=
                          kRegular * static_cast<double>(*middle);
  if (is_regular || period_ns_) period_ns_ = *middle;
}

std::optional<std::int64_t> SilenceMonitor::longestSilence() const {
  const std::int64_t longest =
      period_ns_ ? std::clamp(kMissed * *period_ns_, bounds_.shortest, bounds_.longest)
                 : bounds_.longest;
  return longest == SilenceBounds::kForEver ? std::nullopt : std::optional(longest);
}

bool SilenceMonitor::isOverdue(SteadyTime now) const {
  const std::optional<std::int64_t> longest = longestSilence();
  return last_ && longest && now.ns - last_->ns > *longest;
}

double SilenceMonitor::silence(Stamp now) const {
  return last_ ? static_cast<double>(now.ns - last_->ns) * 1e-9 : 0;
}

}  // namespace afterglow::replay
