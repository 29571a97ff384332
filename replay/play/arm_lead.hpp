/// \file
/// The time that joints get to go to where their trajectories go on: the timeline stands meanwhile.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "replay/clock/clock.hpp"
#include "replay/motion/arm_start.hpp"
#include "replay/play/transport.hpp"

namespace afterglow::replay {

/// Without PlayOptions::arm_start nobody looks at joints; after a seek they are given time all the
/// same. The thread that plays. Everything given outlives it.
class ArmLead {
 public:
  ArmLead(const PlayOptions& options, Transport& transport, Clock& clock)
      : options_(options), transport_(transport), clock_(clock) {}

  /// Whether joints are looked at.
  bool hasArm() const { return options_.arm_start != nullptr; }
  /// What goes on next may find its joints elsewhere.
  void expectElsewhere() { is_elsewhere_expected_ = true; }
  /// So it does if joints still have time to get there.
  void expectElsewhereIfGiven() { is_elsewhere_expected_ |= isGiven(); }
  /// How long it takes the slowest of what goes on; `needed` of each, empty where nobody knows.
  /// Forgets what was expected.
  double leadFor(const std::vector<std::optional<double>>& needed);
  /// The timeline stands at `at` for so long; nothing for 0.
  void give(double seconds, Stamp at);
  bool isGiven() const { return clock_.now() < end_; }
  /// What is left of the time that was given.
  std::int64_t leftNs() const;

  /// What ArmStart says of a goal or trajectory command as it will be sent; empty without an arm.
  std::optional<double> leadOf(const Channel& channel, const Bytes& bytes, Stamp at) const;
  /// The same, to begin where its joints are, in the time that is left. Throws ArmElsewhere,
  /// MessageError.
  Bytes begin(const Channel& channel, const Bytes& bytes, Stamp at) const;

  /// Joints are halted at this moment: they are looked at when they have come to rest.
  void halt(SteadyTime now) { look_ = now.after(kHaltNs); }
  /// They go on, or are halted: looked at now.
  void lookAtHalted();
  /// When to look at them; SteadyTime::forever(): not.
  SteadyTime nextLook() const { return look_; }
  /// The replay goes on elsewhere.
  void forget();

 private:
  static constexpr std::int64_t kHaltNs = 500'000'000;  ///< an arm takes so long to stand

  const PlayOptions& options_;
  Transport& transport_;
  Clock& clock_;
  bool is_elsewhere_expected_ = false;
  SteadyTime end_;
  SteadyTime look_ = SteadyTime::forever();
};

}  // namespace afterglow::replay
