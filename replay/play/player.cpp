#include "replay/play/player.hpp"

#include <exception>
#include <optional>
#include <stdexcept>
#include <utility>

namespace afterglow::replay {
namespace {

bool hasMotion(const PlayPlan& plan) { return !plan.motionTopics().empty(); }

PlayOptions checked(const PlayOptions& options, const PlayPlan& plan) {
  if (hasMotion(plan) && (options.is_looping || options.is_immediate)) {
    throw std::logic_error("the body is not played in a loop, and not at once");
  }
  return options;
}

}  // namespace

Player::Player(const Store& store, const PlayPlan& plan, const PlayOptions& options,
               MessageSink& sink, Clock& clock, const std::function<Stamp()>& ros_now,
               Rewriter::FreshId ids)
    : plan_(plan),
      options_(checked(options, plan)),
      milestones_(options.has_recorded_time ? Milestones() : Milestones::read(store, plan)),
      goals_(options.goals ? *options.goals : own_goals_),
      transport_(plan, options_, clock),
      ledger_(plan),
      play_{plan, options_, clock, transport_, ledger_},
      lead_(play_),
      outbox_(play_, lead_, sink, ros_now, std::move(ids)),
      gate_(play_, milestones_, goals_),
      base_(play_, ros_now, outbox_, gate_),
      body_(play_, milestones_, goals_, outbox_, lead_, gate_),
      scheduler_(play_, {store, hasMotion(plan), ros_now, goals_, outbox_, lead_, gate_, base_,
                         body_}) {
  for (const std::string& note : milestones_.notes) ledger_.note(note);
}

PlayReport Player::run() {
  try {
    scheduler_.play();
  } catch (const std::exception& error) {
    stop(error.what());
  }
  scheduler_.finish();
  PlayReport report = ledger_.report();
  report.rate = options_.rate;
  report.planned_ns = static_cast<std::int64_t>(
      static_cast<double>(plan_.end.ns - plan_.begin.ns) / options_.rate);
  report.in_step.is_gated = gate_.isGated();
  if (const BaseDrive* drive = options_.base_drive) {
    report.base = PlayedBase{drive->topic(), "", drive->report(), ledger_.deviation()};
  }
  report.failures = transport_.failures();
  const std::optional<std::string> stop_reason = transport_.stopReason();
  report.is_complete = !stop_reason || scheduler_.hasEnded();
  report.reason = report.is_complete ? "" : *stop_reason;
  report.goals = goals_.counts();
  for (auto& [planned, counts] : report.topics) {
    if (planned.isPlayed()) planned.rewrites = outbox_.rewrites(planned.channel);
  }
  return report;
}

void Player::onGoalStatus(const std::string& id, const GoalEnd& end) {
  if (goals_.finish(id, end.outcome(), play_.clock.now(), end.words())) {
    play_.clock.wake();
  }
}

PlayProgress Player::progress() const {
  PlayProgress progress = transport_.progress();
  progress.published = outbox_.published();
  const SteadyTime now = play_.clock.now();
  const auto inMs = [now](const RecentWorst& recent) -> std::optional<double> {
    const auto ns = recent.at(now);
    return ns ? std::optional(static_cast<double>(*ns) * 1e-6) : std::nullopt;
  };
  progress.late_ms = inMs(ledger_.recentLateness());
  progress.skew_ms = inMs(ledger_.recentSkew());
  return progress;
}

}  // namespace afterglow::replay
