#include "replay/play/driven_base.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::replay {
namespace {

constexpr std::int64_t kStepNs = 20'000'000;

}  // namespace

DrivenBase::DrivenBase(const PlayContext& play, std::function<Stamp()> ros_now, Outbox& outbox,
                       const StepGate& gate)
    : play_(play),
      ros_now_(std::move(ros_now)),
      outbox_(outbox),
      gate_(gate),
      drive_(play.options.base_drive) {}

void DrivenBase::enter(Stamp at) {
  next_step_ = {};
  if (drive_) drive_->enter(at);
}

void DrivenBase::step() {
  const SteadyTime now = play_.clock.now();
  if (!drive_ || now < next_step_) {
    return;
  }
  next_step_ = std::max(next_step_.after(kStepNs), now.after(kStepNs / 2));
  const Timeline& timeline = play_.timeline();
  const Stamp at = std::min(timeline.recorded(now), play_.plan.end);
  if (!drive_->isBusy(at)) {
    return;
  }
  const Stamp ros_now = ros_now_();
  const BaseDrive::Step step = drive_->step(at, gate_.isHeldByGoal(), timeline.rate(), ros_now);
  if (step.command) outbox_.sendDriven(drive_->message(*step.command, ros_now));
  play_.ledger.addBase(at, now, drive_->progress(), drive_->deviation());
  if (!drive_->failure().empty()) {
    play_.transport.fail(Modality::Body, "the base: " + drive_->failure());
  }
}

}  // namespace afterglow::replay
