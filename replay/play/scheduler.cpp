#include "replay/play/scheduler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
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

namespace {

/// Later than that and overtaken by the next of its topic: not sent.
constexpr std::int64_t kStale = 2'000'000;
/// Later than that light and speech go on from there.
constexpr std::int64_t kStalled = 1'000'000'000;
/// The base has stopped by itself, and settled.
constexpr double kLeastGapOfMotion = 0.5;
/// The first deadline lies this far ahead, so that the first message is no later than the others.
constexpr std::int64_t kLead = 5'000'000;
constexpr double kForever = std::numeric_limits<double>::infinity();

}  // namespace

// ---------------------------------------------------------------------------------------- playing

void Scheduler::play() {
  if (parts_.outbox.topics().empty()) {
    throw std::runtime_error("no topic of this behavior is to be played");
  }
  enter(play_.plan.begin);
  std::uint64_t before = parts_.outbox.published();
  // A round without messages would be over at once, again and again.
  while (playRound() && play_.options.is_looping && parts_.outbox.published() != before) {
    before = parts_.outbox.published();
    moveTo(play_.plan.begin);
  }
}

/// Plays to the end; false: stopped.
bool Scheduler::playRound() {
  for (;;) {
    const Timeline& timeline = play_.timeline();
    const auto next = lanes_->front(timeline.rate(), timeline.limit());
    has_next_ = next.has_value();
    const Wake wake = next ? waitUntil(next->message->received, next->early_ns)
                           : waitUntil(play_.plan.end, 0);
    if (wake == Wake::Stopped) return false;
    if (wake == Wake::Moved) continue;
    if (next) {
      const std::string& topic = channels_.channel(next->message->channel).topic;
      const bool may_pause = play_.options.pause_topics.count(topic) > 0;
      if (may_pause && play_.transport.pausesBefore(next->message->sequence)) continue;
      if (!parts_.has_motion) leapAfterStall(next->due());
      playDue();
    } else if (const Wake end = endRound(); end != Wake::Moved) {
      return end == Wake::Due;
    }
  }
}

void Scheduler::playDue() {
  const SteadyTime now = play_.clock.now();
  std::vector<Due> batch = takeDue(now);
  for (auto due = batch.begin(); due != batch.end() && !play_.transport.isStopped(); ++due) {
    const bool is_stale = due->topic && due->topic->is_replacing &&
                          now.ns - due->deadline.ns > kStale;
    const bool is_overtaken = is_stale && std::any_of(due + 1, batch.end(), [&](const Due& later) {
                                return later.topic == due->topic;
                              });
    if (is_overtaken) {
      ++due->topic->report.skipped;
    } else if (due->topic) {
      send(*due);
    }
  }
}

std::vector<Scheduler::Due> Scheduler::takeDue(SteadyTime now) {
  const Timeline& timeline = play_.timeline();
  std::vector<Due> batch;
  std::optional<Stamp> limit = timeline.limit();
  while (const auto next = lanes_->ready(timeline.rate(), limit)) {
    const Stamp received = next->message->received;
    const SteadyTime deadline = parts_.gate.deadlineOf(received, next->early_ns);
    const Channel& channel = channels_.channel(next->message->channel);
    const bool pauses = !batch.empty() && play_.options.pause_topics.count(channel.topic) > 0;
    if (now < deadline || pauses || (limit && received > *limit)) {
      break;
    }
    played_until_ = next->due();
    // A goal in this batch keeps back the messages after its end.
    limit = parts_.gate.limitAfter(limit, channel.topic, received);
    batch.push_back({next->lane->pop(), &channel, parts_.outbox.find(channel.topic), deadline});
  }
  return batch;
}

void Scheduler::send(Due& due) {
  const Stamp received = due.message.received;
  Outbox::Outgoing message{*due.topic, *due.channel, received, received,
                           std::move(due.message.bytes)};
  message.late_ns = play_.clock.now().ns - due.deadline.ns;
  message.released = parts_.gate.releasedAt();
  if (!parts_.outbox.leavesOut(message)) parts_.body.send(std::move(message));
}

void Scheduler::leapAfterStall(Stamp recorded) {
  const std::int64_t late_ns =
      play_.clock.now().ns - play_.timeline().deadline(recorded).ns;
  if (late_ns > kStalled) {
    play_.ledger.note("stalled for " + std::to_string(late_ns / 1'000'000) +
                        " ms, and went on from there");
    leapTo(recorded);
  }
}

void Scheduler::leapTo(Stamp recorded) {
  play_.transport.change([&](Timeline& timeline) {
    timeline.moveTo(std::min(recorded, timeline.limit().value_or(recorded)), play_.clock.now());
  });
  parts_.outbox.forgetShift();
}

/// Returns where the wait for a recorded moment is cut short.
std::optional<Stamp> Scheduler::leapBefore(Stamp recorded) const {
  const Stamp at = play_.timeline().recorded(play_.clock.now());
  const std::optional<double> skip_empty_s = play_.options.skip_empty_s;
  if (!skip_empty_s || parts_.goals.hasOpen() || parts_.base.isBusy(at)) {
    return std::nullopt;
  }
  const double kept = std::max(*skip_empty_s, parts_.has_motion ? kLeastGapOfMotion : 0.0);
  const Stamp leap{played_until_.ns + static_cast<std::int64_t>(kept * 1e9)};
  return leap < recorded ? std::optional(leap) : std::nullopt;
}

// ------------------------------------------------------------------------------------------ waits

Scheduler::Wake Scheduler::waitUntil(Stamp recorded, std::int64_t early_ns) {
  const Timeline& timeline = play_.timeline();
  const Stamp due{recorded.ns - early_ns};
  const double rate = timeline.rate();
  for (;;) {
    const Wake wake = followRequests();
    if (wake != Wake::Due) {
      return wake;
    }
    if (keepInStep() || timeline.rate() != rate) {
      return Wake::Moved;  // something else may be next
    }
    if (play_.options.is_immediate && !timeline.isPaused()) {
      leapTo(due);
      return Wake::Due;
    }
    const std::optional<Stamp> leap = leapBefore(due);
    const SteadyTime deadline =
        leap ? timeline.deadline(*leap) : parts_.gate.deadlineOf(recorded, early_ns);
    const SteadyTime step = nextStep();
    if (play_.clock.sleepUntil(std::min(deadline, step)) && deadline <= step) {
      if (leap) leapTo(due);
      return Wake::Due;
    }
  }
}

Scheduler::Wake Scheduler::waitFor(double seconds, const std::function<bool()>& is_over) {
  const Timeline& timeline = play_.timeline();
  const SteadyTime deadline =
      std::isfinite(seconds) ? play_.clock.now().after(static_cast<std::int64_t>(seconds * 1e9))
                             : SteadyTime::forever();
  const std::int64_t paused_before = timeline.pausedNs();
  for (;;) {
    const Wake wake = followRequests();
    if (wake == Wake::Due) keepInStep();
    if (wake != Wake::Due || is_over()) {
      return wake;
    }
    const bool has_end = !timeline.isPaused() && std::isfinite(seconds);
    const SteadyTime end =
        has_end ? deadline.after(timeline.pausedNs() - paused_before) : SteadyTime::forever();
    const SteadyTime step = nextStep();
    if (play_.clock.sleepUntil(std::min(end, step)) && end <= step) {
      return Wake::Due;
    }
  }
}

/// Returns when there is something to do though no message is due.
SteadyTime Scheduler::nextStep() const {
  return play_.timeline().isPaused()
             ? parts_.lead.nextLook()
             : std::min({parts_.base.nextStep(), parts_.gate.nextLook(), parts_.body.nextCancel()});
}

/// True if the limit has moved.
bool Scheduler::keepInStep() {
  if (parts_.lead.nextLook() <= play_.clock.now()) parts_.lead.lookAtHalted();
  if (play_.timeline().isPaused()) {
    return false;
  }
  parts_.base.step();
  parts_.body.cancelDue();
  const auto reached = parts_.body.followEnds();
  if (play_.transport.isStopped()) {
    return true;  // nothing is to go on because of it
  }
  const StepGate::Move move = parts_.gate.moveLimit(reached);
  if (move.goes_on_from) parts_.body.sendVelocities(*move.goes_on_from);
  const StepGate::Stand stand = parts_.gate.stand();
  if (stand.begins) parts_.outbox.standStill();
  if (!stand.too_long.empty()) play_.transport.fail(Modality::Body, stand.too_long);
  return move.has_moved;
}

// --------------------------------------------------------------------------- what is wanted of it

Scheduler::Wake Scheduler::followRequests() {
  const Transport::Orders orders = play_.transport.takeOrders(has_next_);
  if (orders.stops) {
    return Wake::Stopped;
  }
  if (orders.pauses) pause();
  if (orders.rate) setRate(*orders.rate);
  if (orders.seek) moveTo(*orders.seek);
  for (std::uint64_t i = 0; i < orders.steps && !play_.transport.isStopped() && step(); ++i) {
  }
  if (orders.resumes) resume();
  return orders.seek || orders.steps > 0 ? Wake::Moved : Wake::Due;
}

void Scheduler::pause() {
  const SteadyTime now = play_.clock.now();
  // An arm that is late gets time to catch up.
  parts_.lead.expectElsewhereIfGiven();
  if (parts_.gate.pause()) parts_.lead.expectElsewhere();
  play_.transport.change([&](Timeline& timeline) { timeline.pause(now); });
  parts_.body.suspend(now);
}

void Scheduler::resume() {
  play_.transport.change([&](Timeline& timeline) { timeline.resume(play_.clock.now()); });
  parts_.body.proceed();
}

void Scheduler::setRate(double rate) {
  const bool is_moving = !play_.timeline().isPaused();
  if (is_moving) parts_.gate.interrupt();
  parts_.lead.expectElsewhereIfGiven();
  if (parts_.gate.isHeldByGoal()) parts_.lead.expectElsewhere();
  if (is_moving) parts_.body.suspendGoals();
  play_.transport.change(
      [&](Timeline& timeline) { timeline.setRate(rate, play_.clock.now()); });
  if (!is_moving) return;
  parts_.body.proceed();
  parts_.body.cancelOvertaken();
}

/// False: nothing is left.
bool Scheduler::step() {
  const auto next = lanes_->front(play_.timeline().rate(), std::nullopt);
  if (!next) {
    return false;
  }
  leapTo(next->due());
  played_until_ = next->due();
  const Channel& channel = channels_.channel(next->message->channel);
  Message message = next->lane->pop();
  if (OutboxTopic* topic = parts_.outbox.find(channel.topic)) {
    parts_.body.send(
        {*topic, channel, message.received, message.received, std::move(message.bytes)});
  }
  return true;
}

// -------------------------------------------------------------------------- another place, the end

/// Begins at a recorded moment as if everything before it had been played.
void Scheduler::enter(Stamp at) {
  const SceneAt scene = readScene(at);
  auto lanes = std::make_unique<MessageLanes>(parts_.store, play_.plan,
                                              play_.options.latency_s, at,
                                              play_.options.prefetch_bytes);
  play_.transport.cancelOnStop(*lanes);
  std::swap(lanes_, lanes);
  if (lanes) play_.ledger.addDamage(lanes->end());
  lanes_->fill();
  parts_.outbox.clearProjection();
  // Messages with a latency go out before the first moment and need that time.
  const std::int64_t lead_ns =
      play_.options.is_immediate ? 0 : kLead + earlyNs(parts_.outbox.latency(), 1);
  const SteadyTime first = play_.clock.now().after(lead_ns);
  if (!play_.transport.hasBegun()) play_.ledger.begin(first);
  play_.transport.enter(at, first);
  parts_.gate.enter();
  parts_.base.enter(at);
  parts_.outbox.forgetShift();
  played_until_ = at;
  show(scene, at);
  std::vector<std::pair<Channel, Message>> targets;
  for (Message& message : scene.targets()) {
    targets.emplace_back(channels_.channel(message.channel), std::move(message));
  }
  parts_.body.setTargets(targets);
  const bool stands = play_.timeline().isPaused() || play_.transport.isStopped();
  if (!stands) parts_.body.proceed();
}

void Scheduler::moveTo(Stamp to) {
  parts_.gate.interrupt();
  parts_.body.abandon();
  enter(to);
}

SceneAt Scheduler::readScene(Stamp at) {
  const PlayPlan& plan = play_.plan;
  SceneAt scene;
  std::set<std::string> unrepeated;
  if (at <= plan.behavior.begin) {
    return scene;
  }
  const auto cursor =
      parts_.store.messages(plan.behavior, {plan.playedTopics(), plan.behavior.begin, at});
  while (auto message = play_.transport.isStopped() ? std::nullopt : cursor->next()) {
    const Channel& channel = channels_.channel(message->channel);
    if (const OutboxTopic* topic = parts_.outbox.find(channel.topic)) {
      if (topic->planned.rule_stop.kind != StopKind::None) unrepeated.insert(channel.topic);
      scene.add(channel, topic->planned.modality, std::move(*message));
    }
  }
  // A position that was commanded there may be far from here, and nothing bounds the way to it.
  for (const std::string& topic : unrepeated) {
    play_.ledger.note(fmt::format(
        "what {} was told until {:.2f} s was not sent again when the replay went on there: only a "
        "rule knows how it is stopped, and nobody the way there",
        topic, 1e-9 * static_cast<double>(at.ns - plan.behavior.begin.ns)));
  }
  return scene;
}

void Scheduler::show(const SceneAt& scene, Stamp at) {
  for (Message& message : scene.light(at)) {
    const Channel& channel = channels_.channel(message.channel);
    // Each as if it came now: the moment it came at is too far back for tf.
    const Stamp now = play_.options.has_recorded_time ? message.received : parts_.ros_now();
    Outbox::Outgoing shown{parts_.outbox.topic(channel.topic), channel, message.received,
                           message.received, std::move(message.bytes)};
    shown.moment = PublishMoment{now, now.ns - message.received.ns};
    parts_.body.send(std::move(shown));
  }
}

Scheduler::Wake Scheduler::endRound() {
  const PlayOptions& options = play_.options;
  // The base gives up by itself.
  const Wake arrived = waitFor(kForever, [&] { return !parts_.base.isBusy(play_.plan.end); });
  if (arrived != Wake::Due) {
    return arrived;
  }
  play_.ledger.measureLength(play_.timeline(), play_.clock.now());
  parts_.outbox.sendZeroVelocities();
  const auto all_done = [&] {
    return !play_.timeline().isPaused() && !parts_.goals.hasOpen();
  };
  const Wake wake = waitFor(options.goal_wait_s, all_done);
  if (wake != Wake::Due) {
    return wake;
  }
  if (!all_done()) {
    play_.ledger.note(fmt::format(
        "goals were still under way {:.4g} s after the behavior's end, and were canceled",
        options.goal_wait_s));
  }
  parts_.body.giveUpGoals();
  has_ended_ = options.keeps_alive;
  const bool holds = options.clear_projection && parts_.outbox.isLit() && !options.is_looping;
  const double hold_s = options.keeps_alive ? kForever : holds ? options.hold_s : 0;
  const Wake end = waitFor(hold_s, [hold_s] { return hold_s <= 0; });
  has_ended_ = has_ended_ && end != Wake::Moved;
  return end;
}

void Scheduler::finish() {
  if (play_.transport.hasBegun()) {
    const Timeline& timeline = play_.timeline();
    // It did not come to the end.
    if (!play_.ledger.hasLength()) play_.ledger.measureLength(timeline, play_.clock.now());
    parts_.gate.interrupt();
  }
  parts_.body.giveUpGoals();
  parts_.outbox.sendZeroVelocities();
  parts_.body.haltCommands(play_.transport.isStopped() ? BodyInForce::Halts::All
                                                       : BodyInForce::Halts::Targets);
  if (play_.options.clear_projection) parts_.outbox.clearProjection();
  if (lanes_) play_.ledger.addDamage(lanes_->end());
}

}  // namespace afterglow::replay
