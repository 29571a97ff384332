#include "replay/motion/stops/patience.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <iterator>

#include "replay/motion/stops/heartbeat.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kLeastBeside = 60 * kMs;
/// The addition for a player that others keep from a processor all the time.
constexpr std::int64_t kMoreForWaiting = 90 * kMs;
constexpr std::int64_t kLeastAfar = 300 * kMs;
/// Factors for the worst of a replay, from which a second's measurement is far.
constexpr std::int64_t kWorseBeside = 10, kWorseAfar = 4;
constexpr int kLooksNeeded = 15;
/// The times that a second's measurement has to fit: beats come every 20 ms, and late again.
constexpr std::int64_t kFits = 2;

/// Rounds to steps of 10 ms, for people.
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

double waitingPart(const std::string& pressure, const std::string& load, unsigned processors) {
  double most = 0;
  for (const char* average : {"avg10=", "avg60="}) {  // of the line "some", which is the first
    const std::size_t at = pressure.find(average);
    if (at != std::string::npos) {
      most = std::max(most, std::strtod(pressure.c_str() + at + std::strlen(average), nullptr) / 100);
    }
  }
  if (pressure.empty() && processors > 0) most = std::strtod(load.c_str(), nullptr) / processors - 1;
  return std::min(std::max(most, 0.0), 1.0);
}

std::int64_t patienceBeside(const MachineLateness& machine) {
  const auto for_waiting = static_cast<std::int64_t>(machine.waiting * kMoreForWaiting);
  return std::min(kLeastBeside + rounded(kWorseBeside * machine.woken_ns + for_waiting),
                  kMostPatienceBeside);
}

std::string whyTooLate(const MachineLateness& machine) {
  if (kFits * machine.woken_ns <= kMostPatienceBeside) return "";
  return "this machine is busy and up to " + std::to_string(machine.woken_ns / kMs) +
         " ms late, and the watchdog waits " + std::to_string(kMostPatienceBeside / kMs) + " ms " +
         kAllowsMore;
}

std::int64_t patienceAfar(std::int64_t longest_gap_ns) {
  const std::int64_t late_ns = std::max<std::int64_t>(0, longest_gap_ns - kBeatPeriod);
  return std::min(kLeastAfar + rounded(kWorseAfar * late_ns), kMostPatienceAfar);
}

}  // namespace afterglow::replay
