/// \file
/// The base that is driven along its recorded track while the other messages are played.
#pragma once

#include "replay/clock/clock.hpp"
#include "replay/motion/base_drive.hpp"
#include "replay/play/outbox.hpp"
#include "replay/play/step_gate.hpp"

namespace afterglow::replay {

/// Steps PlayOptions::base_drive; without one all of it does nothing. The thread that plays.
/// Everything given outlives it.
class DrivenBase {
 public:
  DrivenBase(const PlayPlan& plan, const PlayOptions& options, Clock& clock,
             std::function<Stamp()> ros_now, Transport& transport, Outbox& outbox,
             const StepGate& gate, Ledger& ledger);

  /// The replay begins there, or goes on there.
  void enter(Stamp at);
  /// If a step is due: sends its command. The body has failed if the base is lost.
  void step();
  /// When step() is due.
  SteadyTime nextStep() const { return drive_ ? next_step_ : SteadyTime::forever(); }
  /// Under way at this recorded moment, or to arrive yet.
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
