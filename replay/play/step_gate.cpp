#include "replay/play/step_gate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "replay/motion/base/base_drive.hpp"

namespace afterglow::replay {

/// Returns in real time the wait that the leap to a milestone makes good.
std::int64_t StepGate::marginNow() const {
  return std::llround(static_cast<double>(kMilestoneMarginNs) / play_.timeline().rate());
}

std::int64_t StepGate::longestWait() const {
  return marginNow() + static_cast<std::int64_t>(play_.options.goal_wait_s * 1e9);
}

bool StepGate::isHeldByGoal() const {
  return is_goal_limit_ && play_.timeline().isHeld(play_.clock.now());
}

bool StepGate::isWaitedFor(const std::optional<Milestone>& milestone) const {
  const Stamp at = play_.timeline().recorded(play_.clock.now());
  return milestone && milestone->is_awaited && isHeldByGoal() && at < milestone->at &&
         milestone->at.ns - kMilestoneMarginNs <= at.ns;
}

SteadyTime StepGate::deadlineOf(Stamp recorded, std::int64_t early_ns) const {
  const SteadyTime own = play_.timeline().deadline(recorded);
  if (early_ns == 0 || own == SteadyTime::forever()) {
    return own;
  }
  const SteadyTime due = play_.timeline().deadline({recorded.ns - early_ns});
  return recorded > lifted_from_ ? std::max(due, std::min(own, lifted_at_)) : due;
}

SteadyTime StepGate::nextLook() const {
  if (!is_goal_limit_) {
    return SteadyTime::forever();
  }
  const Timeline& timeline = play_.timeline();
  const SteadyTime held_since = timeline.deadline(*timeline.limit());
  return held_since.after(is_standing_ ? longestWait() : marginNow());
}

std::optional<Stamp> StepGate::limitAfter(std::optional<Stamp> limit, const std::string& topic,
                                          Stamp recorded_at) const {
  const auto milestone = isGated() ? milestones_.of(topic, recorded_at) : std::nullopt;
  if (!milestone || !milestone->is_awaited) {
    return limit;
  }
  const Stamp end{milestone->at.ns - kMilestoneMarginNs};
  return limit ? std::min(*limit, end) : end;
}

// --------------------------------------------------------------------------------------- the limit

StepGate::Move StepGate::moveLimit(const std::optional<GoalBook::Ended>& reached) {
  std::optional<Stamp> limit;
  const auto goal = isGated() ? goals_.nextMilestone() : std::nullopt;
  if (goal && goal->second.at.ns - kMilestoneMarginNs < play_.plan.end.ns) {
    limit = Stamp{goal->second.at.ns - kMilestoneMarginNs};
  }
  const BaseDrive* drive = isGated() ? play_.options.base_drive : nullptr;
  const bool is_goal = limit && !(drive && drive->limit() < *limit);
  if (drive && !is_goal) limit = drive->limit();
  if (limit == asked_limit_ && !reached) {
    return {};
  }
  const std::optional<Stamp> goes_on_from = setLimit(limit, reached);
  is_goal_limit_ = is_goal;
  awaited_ = is_goal ? goal->first : drive ? drive->topic() : "";
  return {true, goes_on_from};
}

/// If the timeline stood, it goes on from there, or from the milestone that was reached.
std::optional<Stamp> StepGate::setLimit(std::optional<Stamp> limit,
                                        const std::optional<GoalBook::Ended>& reached) {
  const Timeline& timeline = play_.timeline();
  const SteadyTime now = play_.clock.now();
  const bool was_held = timeline.isHeld(now);
  const Stamp from = timeline.recorded(now);
  const SteadyTime since = was_held ? timeline.deadline(from) : now;
  const SteadyTime when = reached ? std::max(reached->at, timeline.resumedAt()) : now;
  Stamp to = reached ? reached->milestone->at : from;
  if (limit) to = std::max(from, std::min(to, *limit));
  play_.transport.change([&](Timeline& changed) {
    changed.setLimit(limit, now);
    if (reached) changed.moveTo(to, when);
  });
  asked_limit_ = limit;
  if (!was_held) {
    return std::nullopt;
  }
  lifted_from_ = from;
  lifted_at_ = when;
  const double leapt_ns = static_cast<double>(to.ns - from.ns) / timeline.rate();
  const double stood_ns = static_cast<double>(when.ns - since.ns);
  play_.ledger.addWait(from, since, 1e-9 * (stood_ns - leapt_ns), awaited_);
  const bool goes_on = !timeline.isHeld(now) && std::exchange(is_standing_, false);
  return goes_on ? std::optional(from) : std::nullopt;
}

StepGate::Stand StepGate::stand() {
  if (!isHeldByGoal()) {
    return {};
  }
  const Stamp limit = *play_.timeline().limit();
  const std::int64_t held_ns = play_.clock.now().ns - play_.timeline().deadline(limit).ns;
  Stand stand;
  stand.begins = held_ns >= marginNow() && !std::exchange(is_standing_, true);
  if (held_ns >= longestWait()) {
    stand.too_long =
        fmt::format("a goal on {} took {:.4g} s longer than it did when it was recorded", awaited_,
                    play_.options.goal_wait_s);
    goals_.giveUpWaiting({limit.ns + kMilestoneMarginNs});
  }
  return stand;
}

// ---------------------------------------------------------------------------------- interruptions

bool StepGate::pause() {
  interrupt();
  is_standing_ = isHeldByGoal();
  return is_standing_;
}

void StepGate::interrupt() {
  const Timeline& timeline = play_.timeline();
  const SteadyTime now = play_.clock.now();
  if (timeline.isHeld(now)) {
    const Stamp at = *timeline.limit();
    const SteadyTime since = timeline.deadline(at);
    play_.ledger.addWait(at, since, 1e-9 * static_cast<double>(now.ns - since.ns), awaited_);
  }
  play_.ledger.restartSkew();
}

void StepGate::enter() {
  asked_limit_.reset();
  is_goal_limit_ = is_standing_ = false;
  lifted_at_ = {};
}

}  // namespace afterglow::replay
