/// \file
/// The driven base: follows its recorded track while the other messages are played.
#pragma once

#include <functional>

#include "replay/clock/clock.hpp"
#include "replay/motion/base_drive.hpp"
#include "replay/play/outbox.hpp"
#include "replay/play/step_gate.hpp"

namespace afterglow::replay {

/// Steps PlayOptions::base_drive; does nothing without one. For the thread that plays. Everything
/// given outlives it.
class DrivenBase {
 public:
  DrivenBase(const PlayPlan& plan, const PlayOptions& options, Clock& clock,
             std::function<Stamp()> ros_now, Transport& transport, Outbox& outbox,
             const StepGate& gate, Ledger& ledger);

  /// The replay begins at this recorded moment, or goes on there.
  void enter(Stamp at);
  /// Sends the next command if one is due. A lost base is a failure of the body.
  void step();
  /// When step() is due.
  SteadyTime nextStep() const { return drive_ ? next_step_ : SteadyTime::forever(); }
  /// The base is driven at this recorded moment, or has not arrived yet.
  bool isBusy(Stamp at) const { return drive_ && drive_->isBusy(at); }

 private:
  const Stamp end_;
  BaseDrive* const drive_;
  Clock& clock_;
  const std::function<Stamp()> ros_now_;
  Transport& transport_;
  Outbox& outbox_;
  const StepGate& gate_;
  Ledger& ledger_;
  SteadyTime next_step_;
};

}  // namespace afterglow::replay
