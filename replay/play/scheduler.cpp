#include "replay/play/scheduler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace afterglow::replay {
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
  enter(parts_.plan.begin);
  std::uint64_t before = parts_.outbox.published();
  // A round without messages would be over at once, again and again.
  while (playRound() && parts_.options.is_looping && parts_.outbox.published() != before) {
    before = parts_.outbox.published();
    moveTo(parts_.plan.begin);
  }
}

/// To the end; false: stopped.
bool Scheduler::playRound() {
  for (;;) {
    const Timeline& timeline = parts_.transport.timeline();
    const auto next = lanes_->front(timeline.rate(), timeline.limit());
    has_next_ = next.has_value();
    const Wake wake = next ? waitUntil(next->message->received, next->early_ns)
                           : waitUntil(parts_.plan.end, 0);
    if (wake == Wake::Stopped) return false;
    if (wake == Wake::Moved) continue;
    if (next) {
      if (pausesBefore(*next->message)) continue;
      if (!parts_.has_motion) leapAfterStall(next->due());
      playDue();
    } else if (const Wake end = endRound(); end != Wake::Moved) {
      return end == Wake::Due;
    }
  }
}

void Scheduler::playDue() {
  const SteadyTime now = parts_.clock.now();
  std::vector<Due> batch = takeDue(now);
  for (auto due = batch.begin(); due != batch.end() && !parts_.transport.isStopped(); ++due) {
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
  const Timeline& timeline = parts_.transport.timeline();
  std::vector<Due> batch;
  std::optional<Stamp> limit = timeline.limit();
  while (const auto next = lanes_->ready(timeline.rate(), limit)) {
    const Stamp received = next->message->received;
    const SteadyTime deadline = parts_.gate.deadlineOf(received, next->early_ns);
    const Channel& channel = channelOf(next->message->channel);
    const bool pauses = !batch.empty() && parts_.options.pause_topics.count(channel.topic) > 0;
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
  message.late_ns = parts_.clock.now().ns - due.deadline.ns;
  message.released = parts_.gate.releasedAt();
  if (!parts_.outbox.leavesOut(message)) parts_.body.send(std::move(message));
}

void Scheduler::leapAfterStall(Stamp recorded) {
  const std::int64_t late_ns =
      parts_.clock.now().ns - parts_.transport.timeline().deadline(recorded).ns;
  if (late_ns > kStalled) {
    parts_.ledger.note("stalled for " + std::to_string(late_ns / 1'000'000) +
                        " ms, and went on from there");
    leapTo(recorded);
  }
}

void Scheduler::leapTo(Stamp recorded) {
  parts_.transport.change([&](Timeline& timeline) {
    timeline.moveTo(std::min(recorded, timeline.limit().value_or(recorded)), parts_.clock.now());
  });
  parts_.outbox.forgetShift();
}

/// Where the wait for a recorded moment is cut short.
std::optional<Stamp> Scheduler::leapBefore(Stamp recorded) const {
  const Stamp at = parts_.transport.timeline().recorded(parts_.clock.now());
  const std::optional<double> skip_empty_s = parts_.options.skip_empty_s;
  if (!skip_empty_s || parts_.goals.hasOpen() || parts_.base.isBusy(at)) {
    return std::nullopt;
  }
  const double kept = std::max(*skip_empty_s, parts_.has_motion ? kLeastGapOfMotion : 0.0);
  const Stamp leap{played_until_.ns + static_cast<std::int64_t>(kept * 1e9)};
  return leap < recorded ? std::optional(leap) : std::nullopt;
}

bool Scheduler::pausesBefore(const Message& message) {
  return parts_.options.pause_topics.count(channelOf(message.channel).topic) > 0 &&
         parts_.transport.pausesBefore(message.sequence);
}

// ------------------------------------------------------------------------------------------ waits

Scheduler::Wake Scheduler::waitUntil(Stamp recorded, std::int64_t early_ns) {
  const Timeline& timeline = parts_.transport.timeline();
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
    if (parts_.options.is_immediate && !timeline.isPaused()) {
      leapTo(due);
      return Wake::Due;
    }
    const std::optional<Stamp> leap = leapBefore(due);
    const SteadyTime deadline =
        leap ? timeline.deadline(*leap) : parts_.gate.deadlineOf(recorded, early_ns);
    const SteadyTime step = nextStep();
    if (parts_.clock.sleepUntil(std::min(deadline, step)) && deadline <= step) {
      if (leap) leapTo(due);
      return Wake::Due;
    }
  }
}

Scheduler::Wake Scheduler::waitFor(double seconds, const std::function<bool()>& is_over) {
  const Timeline& timeline = parts_.transport.timeline();
  const SteadyTime deadline =
      std::isfinite(seconds) ? parts_.clock.now().after(static_cast<std::int64_t>(seconds * 1e9))
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
    if (parts_.clock.sleepUntil(std::min(end, step)) && end <= step) {
      return Wake::Due;
    }
  }
}

/// When there is something to do though no message is due.
SteadyTime Scheduler::nextStep() const {
  return parts_.transport.timeline().isPaused()
             ? parts_.lead.nextLook()
             : std::min(parts_.base.nextStep(), parts_.gate.nextLook());
}

/// True if the limit has moved.
bool Scheduler::keepInStep() {
  if (parts_.lead.nextLook() <= parts_.clock.now()) parts_.lead.lookAtHalted();
  if (parts_.transport.timeline().isPaused()) {
    return false;
  }
  parts_.base.step();
  const auto reached = parts_.body.followEnds();
  if (parts_.transport.isStopped()) {
    return true;  // nothing is to go on because of it
  }
  const StepGate::Move move = parts_.gate.moveLimit(reached);
  if (move.goes_on_from) parts_.body.sendVelocities(*move.goes_on_from);
  const StepGate::Stand stand = parts_.gate.stand();
  if (stand.begins) parts_.outbox.standStill();
  if (!stand.too_long.empty()) parts_.transport.fail(Modality::Body, stand.too_long);
  return move.has_moved;
}

// --------------------------------------------------------------------------- what is wanted of it

Scheduler::Wake Scheduler::followRequests() {
  const Transport::Orders orders = parts_.transport.takeOrders(has_next_);
  if (orders.stops) {
    return Wake::Stopped;
  }
  if (orders.pauses) pause();
  if (orders.rate) setRate(*orders.rate);
  if (orders.seek) moveTo(*orders.seek);
  for (std::uint64_t i = 0; i < orders.steps && !parts_.transport.isStopped() && step(); ++i) {
  }
  if (orders.resumes) resume();
  return orders.seek || orders.steps > 0 ? Wake::Moved : Wake::Due;
}

void Scheduler::pause() {
  const SteadyTime now = parts_.clock.now();
  // An arm that is late gets time to catch up.
  parts_.lead.expectElsewhereIfGiven();
  if (parts_.gate.pause()) parts_.lead.expectElsewhere();
  parts_.transport.change([&](Timeline& timeline) { timeline.pause(now); });
  parts_.body.suspend(now);
}

void Scheduler::resume() {
  parts_.transport.change([&](Timeline& timeline) { timeline.resume(parts_.clock.now()); });
  parts_.body.proceed();
}

void Scheduler::setRate(double rate) {
  const bool is_moving = !parts_.transport.timeline().isPaused();
  if (is_moving) parts_.gate.interrupt();
  parts_.lead.expectElsewhereIfGiven();
  if (parts_.gate.isHeldByGoal()) parts_.lead.expectElsewhere();
  if (is_moving) parts_.body.suspendGoals();
  parts_.transport.change(
      [&](Timeline& timeline) { timeline.setRate(rate, parts_.clock.now()); });
  if (is_moving) parts_.body.proceed();
}

/// False: nothing is left.
bool Scheduler::step() {
  const auto next = lanes_->front(parts_.transport.timeline().rate(), std::nullopt);
  if (!next) {
    return false;
  }
  leapTo(next->due());
  played_until_ = next->due();
  const Channel& channel = channelOf(next->message->channel);
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
  auto lanes = std::make_unique<MessageLanes>(parts_.store, parts_.plan,
                                              parts_.options.latency_s, at,
                                              parts_.options.prefetch_bytes);
  parts_.transport.cancelOnStop(*lanes);
  std::swap(lanes_, lanes);
  if (lanes) parts_.ledger.addDamage(lanes->end());
  lanes_->fill();
  parts_.outbox.clearProjection();
  // Messages with a latency go out before the first moment and need that time.
  const std::int64_t lead_ns =
      parts_.options.is_immediate ? 0 : kLead + earlyNs(parts_.outbox.latency(), 1);
  const SteadyTime first = parts_.clock.now().after(lead_ns);
  if (!parts_.transport.hasBegun()) parts_.ledger.begin(first);
  parts_.transport.enter(at, first);
  parts_.gate.enter();
  parts_.base.enter(at);
  parts_.outbox.forgetShift();
  played_until_ = at;
  show(scene, at);
  std::vector<std::pair<Channel, Message>> targets;
  for (Message& message : scene.targets()) {
    targets.emplace_back(channelOf(message.channel), std::move(message));
  }
  parts_.body.setTargets(std::move(targets));
  const bool stands = parts_.transport.timeline().isPaused() || parts_.transport.isStopped();
  if (!stands) parts_.body.proceed();
}

void Scheduler::moveTo(Stamp to) {
  parts_.gate.interrupt();
  parts_.body.abandon();
  enter(to);
}

SceneAt Scheduler::readScene(Stamp at) {
  const PlayPlan& plan = parts_.plan;
  SceneAt scene;
  if (at <= plan.behavior.begin) {
    return scene;
  }
  const auto cursor =
      parts_.store.messages(plan.behavior, {plan.playedTopics(), plan.behavior.begin, at});
  while (auto message = parts_.transport.isStopped() ? std::nullopt : cursor->next()) {
    const Channel& channel = channelOf(message->channel);
    if (const OutboxTopic* topic = parts_.outbox.find(channel.topic)) {
      scene.add(channel, topic->planned.modality, std::move(*message));
    }
  }
  return scene;
}

void Scheduler::show(const SceneAt& scene, Stamp at) {
  for (Message& message : scene.light(at)) {
    const Channel& channel = channelOf(message.channel);
    // Each as if it came now: the moment it came at is too far back for tf.
    const Stamp now = parts_.options.has_recorded_time ? message.received : parts_.ros_now();
    Outbox::Outgoing shown{parts_.outbox.topic(channel.topic), channel, message.received,
                           message.received, std::move(message.bytes)};
    shown.moment = PublishMoment{now, now.ns - message.received.ns};
    parts_.body.send(std::move(shown));
  }
}

Scheduler::Wake Scheduler::endRound() {
  const PlayOptions& options = parts_.options;
  // The base gives up by itself.
  const Wake arrived = waitFor(kForever, [&] { return !parts_.base.isBusy(parts_.plan.end); });
  if (arrived != Wake::Due) {
    return arrived;
  }
  parts_.ledger.measureLength(parts_.transport.timeline(), parts_.clock.now());
  parts_.outbox.sendZeroVelocities();
  const auto all_done = [&] {
    return !parts_.transport.timeline().isPaused() && !parts_.goals.hasOpen();
  };
  const Wake wake = waitFor(options.goal_wait_s, all_done);
  if (wake != Wake::Due) {
    return wake;
  }
  if (!all_done()) {
    parts_.ledger.note(fmt::format(
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
  if (parts_.transport.hasBegun()) {
    const Timeline& timeline = parts_.transport.timeline();
    // It did not come to the end.
    if (!parts_.ledger.hasLength()) parts_.ledger.measureLength(timeline, parts_.clock.now());
    parts_.gate.interrupt();
  }
  parts_.body.giveUpGoals();
  parts_.outbox.sendZeroVelocities();
  if (parts_.transport.isStopped()) parts_.body.haltCommands();
  if (parts_.options.clear_projection) parts_.outbox.clearProjection();
  if (lanes_) parts_.ledger.addDamage(lanes_->end());
}

const Channel& Scheduler::channelOf(std::int64_t id) {
  const auto known = channels_.find(id);
  return known != channels_.end()
             ? known->second
             : channels_.emplace(id, parts_.store.channel(id)).first->second;
}

}  // namespace afterglow::replay
