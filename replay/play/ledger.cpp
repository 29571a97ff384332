#include "replay/play/ledger.hpp"

#include <algorithm>

#include "replay/messages/text.hpp"

namespace afterglow::replay {
namespace {

/// Waits with less between them are one, and shorter ones are not told: a base makes the timeline
/// stumble, it does not stop it.
constexpr double kSameWait = 0.5, kShortestWait = 0.01;

}  // namespace

Ledger::Ledger(const PlayPlan& plan) : plan_(plan) {
  report_.behavior_id = plan.behavior.id;
  report_.behavior_name = plan.behavior.name;
  report_.begin_s = recordedSeconds(plan.begin);
}

void Ledger::begin(SteadyTime first_deadline) {
  first_deadline_ = first_deadline;
  skew_.begin(plan_.behavior.begin, first_deadline);
}

double Ledger::recordedSeconds(Stamp recorded) const {
  return static_cast<double>(recorded.ns - plan_.behavior.begin.ns) * 1e-9;
}

double Ledger::playedSeconds(SteadyTime now) const {
  return static_cast<double>(now.ns - first_deadline_.ns) * 1e-9;
}

void Ledger::addSent(const PlannedTopic& planned, const Sent& sent) {
  TopicReport& report = topic(planned.channel.topic);
  ++report.published;
  report.lateness.add(sent.late_ns);
  recent_lateness_.add(sent.at, sent.late_ns);
  report.moments.add({recordedSeconds(sent.recorded), playedSeconds(sent.at),
                      static_cast<double>(sent.late_ns) * 1e-6});
  if (planned.modality != Modality::Body) {
    const SteadyTime effect = sent.at.after(static_cast<std::int64_t>(sent.latency_s * 1e9));
    skew_.add(planned.modality, sent.recorded, effect, sent.rate);
  }
}

// --------------------------------------------------------------------------------------- the body

void Ledger::addGoal(const GoalBook::Entry& goal, const std::optional<Milestone>& end) {
  const std::string& name = goal.channel.topic;
  if (goal.milestone) skew_.expect(goal.milestone->at);
  std::vector<GoalSpan>& spans = report_.goal_spans;
  const bool is_new = spans_.emplace(std::pair(name, goal.recorded_at.ns), spans.size()).second;
  if (!is_new || spans.size() >= PlayReport::kMostGoals) {
    return;
  }
  GoalSpan span{name, recordedSeconds(goal.recorded_at), playedSeconds(goal.sent_at), {}, {}, {}};
  if (end && end->is_recorded) span.recorded_end_s = recordedSeconds(end->at);
  spans.push_back(std::move(span));
}

void Ledger::endGoal(const GoalBook::Ended& goal) {
  const auto span = spans_.find({goal.channel.topic, goal.recorded_at.ns});
  if (span != spans_.end() && span->second < report_.goal_spans.size()) {
    report_.goal_spans[span->second].outcome = goal.outcome;
    report_.goal_spans[span->second].played_end_s = playedSeconds(goal.at);
  }
  if (goal.milestone) skew_.reach(goal.milestone->at, goal.at);
}

void Ledger::cancelGoals() {
  for (GoalSpan& span : report_.goal_spans) {
    if (span.outcome == GoalOutcome::Open) span.outcome = GoalOutcome::Canceled;
  }
}

void Ledger::addBase(Stamp at, SteadyTime now, std::optional<Stamp> progress,
                     std::optional<double> deviation) {
  if (progress) skew_.reach(*progress, now);
  if (deviation) deviation_.add({recordedSeconds(at), playedSeconds(now), *deviation});
}

void Ledger::addWait(Stamp at, SteadyTime since, double seconds, const std::string& what) {
  const double begin = playedSeconds(since);
  seconds = std::max(0.0, seconds);  // a leap makes good more than was waited
  if (wait_ && wait_->what == what && begin - wait_end_s_ < kSameWait) {
    wait_->seconds += seconds;
  } else {
    endWait(report_.in_step);
    wait_ = PlayWait{recordedSeconds(at), begin, seconds, what};
  }
  wait_end_s_ = begin + seconds;
}

void Ledger::endWait(InStep& in_step) const {
  if (wait_ && wait_->seconds >= kShortestWait) in_step.add(*wait_);
}

// -------------------------------------------------------------------------------------- the replay

void Ledger::addDamage(const std::vector<DamagedMessage>& messages) {
  for (const DamagedMessage& message : messages) damaged_.insert(message.sequence);
}

void Ledger::measureLength(const Timeline& timeline, SteadyTime now) {
  const SteadyTime end = timeline.isPaused() ? timeline.pausedAt() : now;
  report_.actual_ns =
      std::max<std::int64_t>(0, end.ns - first_deadline_.ns - timeline.pausedNs());
}

PlayReport Ledger::report() const {
  PlayReport report = report_;
  endWait(report.in_step);
  report.in_step.skew = skew_.measured();
  if (!damaged_.empty()) {
    report.notes.push_back(counted(damaged_.size(), "damaged message") +
                           (damaged_.size() == 1 ? " was" : " were") +
                           " left out; afterglow store check names what is damaged");
  }
  for (const PlannedTopic& planned : plan_.topics) {
    const auto topic = topics_.find(planned.channel.topic);
    const bool is_played = planned.isPlayed() && topic != topics_.end();
    report.topics.emplace_back(planned, is_played ? topic->second : TopicReport{});
  }
  return report;
}

}  // namespace afterglow::replay
