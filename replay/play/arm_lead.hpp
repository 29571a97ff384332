/// \file
/// The lead: time for joints to go where their trajectories go on. The timeline stands meanwhile.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "replay/motion/arm/arm_start.hpp"
#include "replay/play/transport.hpp"

namespace afterglow::replay {

/// Leads of the arm; without PlayOptions::arm_start the live joints are not known, and after a seek
/// they get a lead all the same. For the thread that plays. Everything given outlives it.
class ArmLead {
 public:
  explicit ArmLead(const PlayContext& play) : play_(play) {}

  /// Returns the live joints; null where they are not known.
  ArmStart* arm() const { return play_.options.arm_start; }
  /// Returns how far a goal that was recorded at `begun` has come at `at`.
  GoalProgress progress(Stamp begun, Stamp at) const;
  /// The motions that go on next may find their joints elsewhere.
  void expectElsewhere() { is_elsewhere_expected_ = true; }
  /// The same, if the joints are still on their way in a lead.
  void expectElsewhereIfGiven() { is_elsewhere_expected_ |= isGiven(); }
  /// The lead for motions with these needs. If joints may be elsewhere, PlayOptions::seek_lead_s at
  /// least for those that are, or of which nothing is known (empty). Ends the expectation.
  double leadFor(const std::vector<std::optional<RestNeed>>& needs);
  /// The timeline stands at `at` for so long; 0: it goes on.
  void give(double seconds, Stamp at);
  bool isGiven() const { return play_.clock.now() < end_; }
  double left_s() const;  ///< the rest of the lead

  /// The joints are halted now; they are looked at when they have come to rest.
  void halt(SteadyTime now) { look_ = now.after(kHaltNs); }
  /// Notes where the halted joints stand.
  void lookAtHalted();
  /// Returns when to call lookAtHalted(); SteadyTime::forever(): not at all.
  SteadyTime nextLook() const { return look_; }
  /// The replay goes on at another recorded moment.
  void forget();

 private:
  static constexpr std::int64_t kHaltNs = 500'000'000;  ///< an arm takes so long to stand

  const PlayContext& play_;
  bool is_elsewhere_expected_ = false;
  SteadyTime end_;
  SteadyTime look_ = SteadyTime::forever();
};

}  // namespace afterglow::replay
