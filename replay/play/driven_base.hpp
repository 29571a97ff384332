/// \file
/// The driven base: follows its recorded track while the other messages are played.
#pragma once

#include <functional>

#include "replay/motion/base_drive.hpp"
#include "replay/play/outbox.hpp"
#include "replay/play/step_gate.hpp"

namespace afterglow::replay {

/// Steps PlayOptions::base_drive; does nothing without one. For the thread that plays. Everything
/// given outlives it.
class DrivenBase {
 public:
  DrivenBase(const PlayContext& play, std::function<Stamp()> ros_now, Outbox& outbox,
             const StepGate& gate);

  /// The replay begins at this recorded moment, or goes on there.
  void enter(Stamp at);
  /// Sends the next command if one is due. A lost base is a failure of the body.
  void step();
  /// Returns when step() is due.
  SteadyTime nextStep() const { return drive_ ? next_step_ : SteadyTime::forever(); }
  /// The base is driven at this recorded moment, or has not arrived yet.
  bool isBusy(Stamp at) const { return drive_ && drive_->isBusy(at); }

 private:
  const PlayContext& play_;
  const std::function<Stamp()> ros_now_;
  Outbox& outbox_;
  const StepGate& gate_;
  BaseDrive* const drive_;
  SteadyTime next_step_;
};

}  // namespace afterglow::replay
