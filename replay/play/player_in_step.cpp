// What the body has done of what it did when it was recorded, and what waits for it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/velocity.hpp"
#include "replay/play/player.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kBaseStep = 20'000'000;
/// Waits with less between them are one, and shorter ones are not told: a base makes the timeline
/// stumble, it does not stop it.
constexpr double kSameWait = 0.5, kShortestWait = 0.01;
constexpr int kMostHeadRepeats = 3;

}  // namespace

bool Player::isGated() const { return options_.is_in_step && !options_.has_recorded_time; }

double Player::playedSeconds(SteadyTime now) const {
  return static_cast<double>(now.ns - first_deadline_.ns) * 1e-9;
}

double Player::recordedSeconds(Stamp recorded) const {
  return static_cast<double>(recorded.ns - plan_.behavior.begin.ns) * 1e-9;
}

/// What waited for the body is due when that is there, unless it was due before by itself.
SteadyTime Player::deadlineOf(Stamp recorded, std::int64_t early_ns) const {
  const SteadyTime own = timeline_->deadline(recorded);
  if (early_ns == 0 || own == SteadyTime::forever()) {
    return own;
  }
  const SteadyTime due = timeline_->deadline({recorded.ns - early_ns});
  return recorded > lifted_from_ ? std::max(due, std::min(own, lifted_at_)) : due;
}

/// True if the limit has moved.
bool Player::keepInStep() {
  if (halt_look_ <= clock_.now()) lookAtHaltedJoints();
  if (timeline_->isPaused()) {
    return false;
  }
  driveBase();
  std::optional<GoalBook::Ended> reached;
  for (const GoalBook::Ended& ended : goals_.takeEnded()) {
    if (repeatHeadGoal(ended)) continue;
    followEnd(ended);
    const bool is_later = !reached || reached->milestone->at < ended.milestone->at;
    if (isWaitedFor(ended.milestone) && is_later) reached = ended;
  }
  if (isStopped()) {
    return true;  // nothing is to go on because of it
  }
  const bool has_moved = moveLimit(reached);
  standWhileHeld();
  return has_moved;
}

/// When there is something to do though no message is due.
SteadyTime Player::nextStep() const {
  if (timeline_->isPaused()) {
    return halt_look_;
  }
  SteadyTime next = options_.base_drive ? next_base_step_ : SteadyTime::forever();
  if (is_goal_limit_) {
    const SteadyTime held_since = timeline_->deadline(*timeline_->limit());
    next = std::min(next, held_since.after(is_standing_ ? longestWait() : marginNow()));
  }
  return next;
}

/// In real time, what the leap to a milestone makes good.
std::int64_t Player::marginNow() const {
  return std::llround(static_cast<double>(kMilestoneMarginNs) / timeline_->rate());
}

std::int64_t Player::longestWait() const {
  return marginNow() + static_cast<std::int64_t>(options_.goal_wait_s * 1e9);
}

// ---------------------------------------------------------------------------------------- the base

void Player::driveBase() {
  BaseDrive* drive = options_.base_drive;
  const SteadyTime now = clock_.now();
  if (!drive || now < next_base_step_) {
    return;
  }
  next_base_step_ = std::max(next_base_step_.after(kBaseStep), now.after(kBaseStep / 2));
  const Stamp at = std::min(timeline_->recorded(now), plan_.end);
  if (!drive->isBusy(at)) {
    return;
  }
  const Stamp ros_now = ros_now_();
  const BaseDrive::Step step = drive->step(at, isHeldByGoal(), timeline_->rate(), ros_now);
  if (step.command) {
    Topic& topic = topics_.at(drive->topic());
    topic.has_moved = true;
    topic.report.was_heard =
        sink_.publish(topic.planned->output, drive->message(*step.command, ros_now));
    ++topic.report.published;
  }
  if (const auto progress = drive->progress()) skew_.reach(*progress, now);
  if (const auto deviation = drive->deviation()) {
    deviation_.add({recordedSeconds(at), playedSeconds(now), *deviation});
  }
  if (!drive->failure().empty()) fail(Modality::Body, "the base: " + drive->failure());
}

// --------------------------------------------------------------------------------------- the goals

void Player::addGoal(GoalBook::Entry entry) {
  const std::string& topic = entry.channel.topic;
  const SteadyTime now = clock_.now();
  entry.sent_at = now;
  const auto milestone = milestones_.of(topic, entry.recorded_at);
  if (milestone && milestone->at > timeline_->recorded(now)) {
    entry.milestone = milestone;
    skew_.expect(milestone->at);
  }
  std::vector<GoalSpan>& spans = report_.goal_spans;
  const bool is_new = spans_.emplace(std::pair(topic, entry.recorded_at.ns), spans.size()).second;
  if (is_new && spans.size() < PlayReport::kMostGoals) {
    GoalSpan span{topic, recordedSeconds(entry.recorded_at), playedSeconds(now), {}, {}, {}};
    if (milestone && milestone->is_recorded) span.recorded_end_s = recordedSeconds(milestone->at);
    spans.push_back(std::move(span));
  }
  goals_.add(std::move(entry));
}

/// Fetch's head controller may take a goal for reached because the one before it was: what ended
/// long before its shortest duration was not done, and is sent again.
bool Player::repeatHeadGoal(const GoalBook::Ended& ended) {
  if (options_.gaze_frame.empty() || !isHeadGoal(ended.channel) ||
      ended.outcome != GoalOutcome::Succeeded) {
    return false;
  }
  const double planned = static_cast<double>(shortestDurationNs(ended.channel, ended.recorded)) /
                         timeline_->rate();
  const bool was_done = static_cast<double>(ended.at.ns - ended.sent_at.ns) > planned / 2;
  int& repeats = head_repeats_[{ended.channel.topic, ended.recorded_at.ns}];
  if (was_done || repeats == kMostHeadRepeats) {
    return false;
  }
  ++repeats;
  sendRest(*topicOf(ended.channel), ended.channel, {ended.recorded, ended.recorded_at}, 0);
  return true;
}

void Player::followEnd(const GoalBook::Ended& ended) {
  const std::string& topic = ended.channel.topic;
  const auto span = spans_.find({topic, ended.recorded_at.ns});
  if (span != spans_.end() && span->second < report_.goal_spans.size()) {
    report_.goal_spans[span->second].outcome = ended.outcome;
    report_.goal_spans[span->second].played_end_s = playedSeconds(ended.at);
  }
  if (ended.milestone) skew_.reach(ended.milestone->at, ended.at);
  const auto recorded = milestones_.of(topic, ended.recorded_at);
  const bool failed_then = recorded && recorded->outcome != GoalOutcome::Succeeded;
  // The player's own cancels are not told here: somebody else wanted the body to stop.
  const bool was_canceled = ended.outcome == GoalOutcome::Canceled && isGated() &&
                            ended.milestone && ended.milestone->is_awaited;
  if ((ended.outcome == GoalOutcome::Failed && !failed_then) || was_canceled) {
    const Modality modality = topics_.at(topic).planned->modality;  // sound_play's is speech
    fail(modality, "a goal on " + topic +
                       (was_canceled ? " was canceled" : " was aborted, rejected or lost") +
                       (recorded ? ", and was not when it was recorded" : ""));
  }
}

/// The timeline stands because of it.
bool Player::isWaitedFor(const std::optional<Milestone>& milestone) const {
  const Stamp at = timeline_->recorded(clock_.now());
  return milestone && milestone->is_awaited && isHeldByGoal() && at < milestone->at &&
         milestone->at.ns - kMilestoneMarginNs <= at.ns;
}

void Player::giveUpGoals() {
  for (const GoalBook::Ended& ended : goals_.takeEnded()) followEnd(ended);
  sendCancels(goals_.cancelOpen());
  for (GoalSpan& span : report_.goal_spans) {
    if (span.outcome == GoalOutcome::Open) span.outcome = GoalOutcome::Canceled;
  }
}

// --------------------------------------------------------------------------------------- the limit

bool Player::isHeldByGoal() const { return is_goal_limit_ && timeline_->isHeld(clock_.now()); }

/// To what the body has not done yet, and to where the base is.
bool Player::moveLimit(std::optional<GoalBook::Ended> reached) {
  std::optional<Stamp> limit;
  const auto goal = isGated() ? goals_.nextMilestone() : std::nullopt;
  if (goal && goal->second.at.ns - kMilestoneMarginNs < plan_.end.ns) {
    limit = Stamp{goal->second.at.ns - kMilestoneMarginNs};
  }
  const bool has_base = isGated() && options_.base_drive;
  const bool is_goal = limit && !(has_base && options_.base_drive->limit() < *limit);
  if (has_base && !is_goal) limit = options_.base_drive->limit();
  if (limit == asked_limit_ && !reached) {
    return false;
  }
  setLimit(limit, reached);
  is_goal_limit_ = is_goal;
  awaited_ = is_goal ? goal->first : has_base ? options_.base_drive->topic() : "";
  return true;
}

/// If the timeline stood, it goes on from there, or from the milestone that was reached.
void Player::setLimit(std::optional<Stamp> limit, const std::optional<GoalBook::Ended>& reached) {
  const SteadyTime now = clock_.now();
  const bool was_held = timeline_->isHeld(now);
  const Stamp from = timeline_->recorded(now);
  const SteadyTime since = was_held ? timeline_->deadline(from) : now;
  const SteadyTime when = reached ? std::max(reached->at, resumed_at_) : now;
  Stamp to = reached ? reached->milestone->at : from;
  if (limit) to = std::max(from, std::min(to, *limit));
  changeTimeline([&](Timeline& timeline) {
    timeline.setLimit(limit, now);
    if (reached) timeline.moveTo(to, when);
  });
  asked_limit_ = limit;
  if (!was_held) {
    return;
  }
  lifted_from_ = from;
  lifted_at_ = when;
  const double leapt_ns = static_cast<double>(to.ns - from.ns) / timeline_->rate();
  noteWait(from, since, 1e-9 * (static_cast<double>(when.ns - since.ns) - leapt_ns));
  if (!timeline_->isHeld(now) && std::exchange(is_standing_, false)) {
    for (auto& [name, topic] : topics_) {
      if (topic.is_velocity && !topic.command.bytes.empty()) sendVelocityInForce(topic, from);
    }
  }
}

void Player::standWhileHeld() {
  if (!isHeldByGoal()) {
    return;
  }
  const std::int64_t held_ns = clock_.now().ns - timeline_->deadline(*timeline_->limit()).ns;
  if (held_ns >= marginNow() && !std::exchange(is_standing_, true)) {
    for (auto& [name, topic] : topics_) {
      if (!topic.is_driven) sendZeroVelocity(topic);
    }
  }
  if (held_ns >= longestWait()) {
    fail(Modality::Body,
         fmt::format("a goal on {} took {:.4g} s longer than it did when it was recorded", awaited_,
                     options_.goal_wait_s));
    goals_.giveUpWaiting({timeline_->limit()->ns + kMilestoneMarginNs});
  }
}

// --------------------------------------------------------------------------------------- the waits

void Player::noteWait(Stamp at, SteadyTime since, double seconds) {
  const double begin = playedSeconds(since);
  seconds = std::max(0.0, seconds);  // a leap makes good more than was waited
  if (wait_ && wait_->what == awaited_ && begin - wait_end_s_ < kSameWait) {
    wait_->seconds += seconds;
  } else {
    endWait();
    wait_ = PlayWait{recordedSeconds(at), begin, seconds, awaited_};
  }
  wait_end_s_ = begin + seconds;
}

void Player::endWait() {
  if (wait_ && wait_->seconds >= kShortestWait) report_.in_step.add(*wait_);
  wait_.reset();
}

/// Before a pause, another rate, another place.
void Player::forgetSteps() {
  const SteadyTime now = clock_.now();
  if (timeline_->isHeld(now)) {
    const Stamp at = *timeline_->limit();
    const SteadyTime since = timeline_->deadline(at);
    noteWait(at, since, 1e-9 * static_cast<double>(now.ns - since.ns));
  }
  skew_.restart();
}

}  // namespace afterglow::replay
