#include "replay/motion/patience.hpp"

#include <algorithm>
#include <iterator>

namespace afterglow::replay {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kLeastBeside = 60 * kMs, kMostBeside = 150 * kMs;
constexpr std::int64_t kLeastAfar = 300 * kMs;
/// What is seen in a second is far from the worst of a replay.
constexpr std::int64_t kWorseBeside = 10, kWorseAfar = 4;
constexpr int kLooksNeeded = 15;

/// In steps of 10 ms: for people.
std::int64_t rounded(std::int64_t ns) { return ns / (10 * kMs) * (10 * kMs); }

}  // namespace

void BeatJitter::add(SteadyTime wanted, SteadyTime woken) {
  lateness_[count_ % kLooks] = woken.ns - wanted.ns;
  ++count_;
}

bool BeatJitter::isKnown() const { return count_ >= kLooksNeeded; }

std::int64_t BeatJitter::lateness() const {
  return *std::max_element(std::begin(lateness_), std::end(lateness_));
}

std::int64_t patienceBeside(std::int64_t lateness_ns) {
  return std::min(kLeastBeside + rounded(kWorseBeside * lateness_ns), kMostBeside);
}

std::int64_t patienceAfar(std::int64_t longest_gap_ns) {
  const std::int64_t late_ns = std::max<std::int64_t>(0, longest_gap_ns - kBeatPeriod);
  return std::min(kLeastAfar + rounded(kWorseAfar * late_ns), kMostPatienceAfar);
}

}  // namespace afterglow::replay
