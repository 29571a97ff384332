#include "replay/play/driven_base.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::replay {
namespace {

constexpr std::int64_t kStepNs = 20'000'000;

}  // namespace

DrivenBase::DrivenBase(const PlayPlan& plan, const PlayOptions& options, Clock& clock,
                       std::function<Stamp()> ros_now, Transport& transport, Outbox& outbox,
                       const StepGate& gate, Ledger& ledger)
    : end_(plan.end),
      drive_(options.base_drive),
      clock_(clock),
      ros_now_(std::move(ros_now)),
      transport_(transport),
      outbox_(outbox),
      gate_(gate),
      ledger_(ledger) {}

void DrivenBase::enter(Stamp at) {
  next_step_ = {};
  if (drive_) drive_->enter(at);
}

void DrivenBase::step() {
  const SteadyTime now = clock_.now();
  if (!drive_ || now < next_step_) {
    return;
  }
  next_step_ = std::max(next_step_.after(kStepNs), now.after(kStepNs / 2));
  const Timeline& timeline = transport_.timeline();
  const Stamp at = std::min(timeline.recorded(now), end_);
  if (!drive_->isBusy(at)) {
    return;
  }
  const Stamp ros_now = ros_now_();
  const BaseDrive::Step step = drive_->step(at, gate_.isHeldByGoal(), timeline.rate(), ros_now);
  if (step.command) outbox_.sendDriven(drive_->message(*step.command, ros_now));
  ledger_.addBase(at, now, drive_->progress(), drive_->deviation());
  if (!drive_->failure().empty()) {
    transport_.fail(Modality::Body, "the base: " + drive_->failure());
  }
}

}  // namespace afterglow::replay
