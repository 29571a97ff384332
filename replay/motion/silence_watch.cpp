#include "replay/motion/silence_watch.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace afterglow::replay {
namespace {

/// Intervals that show a period, and how many are remembered.
constexpr std::size_t kFewestIntervals = 4, kMostIntervals = 20;
/// The longest of them, in periods, of what still counts as periodic.
constexpr double kRegular = 2.5;
constexpr std::int64_t kMissed = 5;  // periods
/// A fast topic is not silent because a busy machine delivers it late.
constexpr std::int64_t kShortest = 200'000'000;

}  // namespace

void SilenceWatch::heard(SteadyTime now) {
  if (last_) {
    intervals_.push_back(now.ns - last_->ns);
    if (intervals_.size() > kMostIntervals) intervals_.pop_front();
    measurePeriod();
  }
  last_ = now;
}

/// The median: a message that is late, or two that come together, do not change it.
void SilenceWatch::measurePeriod() {
  if (intervals_.size() < kFewestIntervals) return;
  std::vector<std::int64_t> sorted(intervals_.begin(), intervals_.end());
  std::sort(sorted.begin(), sorted.end());
  const std::int64_t median = sorted[sorted.size() / 2];
  const bool is_regular =
      static_cast<double>(sorted.back()) <= kRegular * static_cast<double>(median);
  if (is_regular || period_ns_) period_ns_ = median;
}

std::optional<std::int64_t> SilenceWatch::longestSilence() const {
  if (given_ns_ > 0) return given_ns_;
  if (!period_ns_) return std::nullopt;
  return std::max(kMissed * *period_ns_, kShortest);
}

bool SilenceWatch::isOverdue(SteadyTime now) const {
  const std::optional<std::int64_t> longest = longestSilence();
  return last_ && longest && now.ns - last_->ns > *longest;
}

}  // namespace afterglow::replay
