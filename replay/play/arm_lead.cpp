#include "replay/play/arm_lead.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::replay {

double ArmLead::leadFor(const std::vector<std::optional<RestNeed>>& needs) {
  const bool is_expected = std::exchange(is_elsewhere_expected_, false);
  double lead_s = 0;
  for (const std::optional<RestNeed>& need : needs) {
    const bool takes_lead = is_expected && (!need || need->is_elsewhere);
    lead_s = std::max({lead_s, need ? need->seconds : 0,
                       takes_lead ? play_.options.seek_lead_s : 0});
  }
  return lead_s;
}

void ArmLead::give(double seconds, Stamp at) {
  if (seconds <= 0) {
    return;
  }
  end_ = play_.clock.now().after(static_cast<std::int64_t>(seconds * 1e9));
  play_.transport.change([&](Timeline& timeline) { timeline.moveTo(at, end_); });
}

double ArmLead::left_s() const {
  return static_cast<double>(std::max<std::int64_t>(0, end_.ns - play_.clock.now().ns)) * 1e-9;
}

GoalProgress ArmLead::progress(Stamp begun, Stamp at) const {
  const double recorded_s = static_cast<double>(at.ns - begun.ns) * 1e-9;
  return {begun, at, recorded_s / play_.timeline().rate()};
}

void ArmLead::lookAtHalted() {
  look_ = SteadyTime::forever();
  if (arm()) arm()->halted();
}

void ArmLead::forget() {
  end_ = {};
  look_ = SteadyTime::forever();
  if (arm()) arm()->forgetHalted();
}

}  // namespace afterglow::replay
