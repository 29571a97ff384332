// The player's waits, and how it does what other threads want of it.
#include <algorithm>
#include <cmath>
#include <utility>

#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/velocity.hpp"
#include "replay/play/player.hpp"

namespace afterglow::replay {
namespace {

/// A velocity command holds so long: 0.25 s on a Fetch.
constexpr std::int64_t kVelocityInForce = 250'000'000;
/// The base has stopped by itself, and settled.
constexpr double kLeastGapOfMotion = 0.5;
/// A halted arm has come to rest.
constexpr std::int64_t kHaltNs = 500'000'000;

}  // namespace

bool Player::isStopped() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return requests_.stop_reason.has_value();
}

void Player::changeTimeline(const std::function<void(Timeline&)>& change) {
  const std::lock_guard<std::mutex> lock(mutex_);
  change(*timeline_);
}

// ------------------------------------------------------------------------------------------ waits

Player::Wake Player::waitUntil(Stamp recorded, std::int64_t early_ns) {
  const Stamp due{recorded.ns - early_ns};
  const double rate = timeline_->rate();
  for (;;) {
    const Wake wake = followRequests();
    if (wake != Wake::Due) {
      return wake;
    }
    if (keepInStep() || timeline_->rate() != rate) {
      return Wake::Moved;  // something else may be next
    }
    if (options_.is_immediate && !timeline_->isPaused()) {
      leapTo(due);
      return Wake::Due;
    }
    const std::optional<Stamp> leap = leapBefore(due);
    const SteadyTime deadline = leap ? timeline_->deadline(*leap) : deadlineOf(recorded, early_ns);
    const SteadyTime step = nextStep();
    if (clock_.sleepUntil(std::min(deadline, step)) && deadline <= step) {
      if (leap) leapTo(due);
      return Wake::Due;
    }
  }
}

Player::Wake Player::waitFor(double seconds, const std::function<bool()>& is_over) {
  const SteadyTime deadline = std::isfinite(seconds)
                                  ? clock_.now().after(static_cast<std::int64_t>(seconds * 1e9))
                                  : SteadyTime::forever();
  const std::int64_t paused_before = paused_ns_;
  for (;;) {
    const Wake wake = followRequests();
    if (wake == Wake::Due) keepInStep();
    if (wake != Wake::Due || is_over()) {
      return wake;
    }
    const bool has_end = !timeline_->isPaused() && std::isfinite(seconds);
    const SteadyTime end =
        has_end ? deadline.after(paused_ns_ - paused_before) : SteadyTime::forever();
    const SteadyTime step = nextStep();
    if (clock_.sleepUntil(std::min(end, step)) && end <= step) {
      return Wake::Due;
    }
  }
}

/// Where the wait for a recorded moment is cut short.
std::optional<Stamp> Player::leapBefore(Stamp recorded) const {
  const bool is_driving =
      options_.base_drive && options_.base_drive->isBusy(timeline_->recorded(clock_.now()));
  if (!options_.skip_empty_s || goals_.hasOpen() || is_driving) {
    return std::nullopt;
  }
  const double kept = std::max(*options_.skip_empty_s, has_motion_ ? kLeastGapOfMotion : 0.0);
  const Stamp leap{played_until_.ns + static_cast<std::int64_t>(kept * 1e9)};
  return leap < recorded ? std::optional(leap) : std::nullopt;
}

void Player::leapTo(Stamp recorded) {
  const Stamp to = std::min(recorded, timeline_->limit().value_or(recorded));
  changeTimeline([&](Timeline& timeline) { timeline.moveTo(to, clock_.now()); });
  shift_ns_.reset();
}

bool Player::pausesBefore(const Message& message) {
  if (options_.pause_topics.count(channelOf(message.channel).topic) == 0 ||
      paused_before_ == message.sequence) {
    return false;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!has_pause_topics_) {
    return false;
  }
  paused_before_ = message.sequence;
  requests_.pause = true;
  return true;
}

Player::Wake Player::followRequests() {
  bool pauses = false, resumes = false;
  Requests asked;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (requests_.stop_reason) {
      return Wake::Stopped;
    }
    asked.rate = std::exchange(requests_.rate, std::nullopt);
    asked.seek = std::exchange(requests_.seek, std::nullopt);
    asked.steps = std::exchange(requests_.steps, 0);
    const bool stands = requests_.pause || (requests_.hold && has_next_);
    pauses = stands && !timeline_->isPaused();
    resumes = !stands && timeline_->isPaused();
  }
  if (pauses) suspend();
  if (asked.rate) followRate(*asked.rate);
  if (asked.seek) moveTo(*asked.seek);
  for (std::uint64_t i = 0; i < asked.steps && !isStopped() && step(); ++i) {
  }
  if (resumes) {
    changeTimeline([&](Timeline& timeline) { timeline.resume(clock_.now()); });
    resumed_at_ = clock_.now();
    paused_ns_ += resumed_at_.ns - paused_at_.ns;
    proceed();
  }
  return asked.seek || asked.steps > 0 ? Wake::Moved : Wake::Due;
}

void Player::suspend() {
  paused_at_ = clock_.now();
  forgetSteps();
  is_standing_ = isHeldByGoal();
  // An arm that is late gets time for what it has not done.
  needs_lead_ = needs_lead_ || paused_at_ < lead_end_ || is_standing_;
  changeTimeline([&](Timeline& timeline) { timeline.pause(paused_at_); });
  sendZeroVelocities();
  haltCommands();
  const std::vector<GoalBook::Entry> goals = goals_.suspendOpen();
  sendCancels(goals);
  holdGaze(goals);
  halt_look_ = paused_at_.after(kHaltNs);
}

/// Once, for each time that they were halted.
void Player::lookAtHaltedJoints() {
  halt_look_ = SteadyTime::forever();
  if (options_.arm_start) options_.arm_start->halted();
}

void Player::holdGaze(const std::vector<GoalBook::Entry>& goals) {
  for (const GoalBook::Entry& goal : goals) {
    if (options_.gaze_frame.empty() || !isHeadGoal(goal.channel)) continue;
    trySend(topicOf(goal.channel)->planned->output,
            presentGaze(goal.channel, goal.recorded, options_.gaze_frame, goal.id + "-gaze"));
  }
}

/// Sends what is in force: the rest of goals and trajectories, velocities.
void Player::proceed() {
  shift_ns_.reset();
  if (halt_look_ < SteadyTime::forever()) lookAtHaltedJoints();
  const Stamp at = timeline_->recorded(clock_.now());
  const std::vector<GoalBook::Entry> goals = goals_.takeSuspended();
  try {
    giveTime(leadToProceed(goals, at), at);
  } catch (const ArmElsewhere& error) {
    stop(std::string("it does not go on: ") + error.what());
  }
  const std::int64_t wait_ns = std::max<std::int64_t>(0, lead_end_.ns - clock_.now().ns);
  const auto lead_ns = static_cast<std::int64_t>(static_cast<double>(wait_ns) * timeline_->rate());
  for (const GoalBook::Entry& goal : goals) {
    if (isStopped()) return;
    sendRest(*topicOf(goal.channel), goal.channel, {goal.recorded, goal.recorded_at}, lead_ns);
  }
  for (auto& [name, topic] : topics_) {
    if (topic.command.bytes.empty()) {
      continue;
    }
    if (isStopped()) return;
    if (topic.is_velocity) {
      if (!isHeldByGoal()) sendVelocityInForce(topic, at);
    } else {
      sendRest(topic, topic.planned->channel, Recorded(topic.command), lead_ns);
    }
  }
}

/// The time that the slowest of them needs to get to where it goes on; 0: it goes on at once.
double Player::leadToProceed(const std::vector<GoalBook::Entry>& goals, Stamp at) {
  const bool may_be_elsewhere = std::exchange(needs_lead_, false);
  double lead_s = 0;
  const auto add = [&](const Channel& channel, const Recorded& whole) {
    const std::optional<double> needed = leadOf(channel, whole, at);
    const bool takes_lead = may_be_elsewhere && needed != 0.0;
    lead_s = std::max({lead_s, needed.value_or(0), takes_lead ? options_.seek_lead_s : 0});
  };
  for (const GoalBook::Entry& goal : goals) {
    add(goal.channel, {goal.recorded, goal.recorded_at});
  }
  for (const auto& [name, topic] : topics_) {
    const bool is_in_force = !topic.command.bytes.empty() && !topic.is_velocity;
    if (is_in_force) add(topic.planned->channel, topic.command);
  }
  return lead_s;
}

/// Empty if it is not known where the motion finds its joints.
std::optional<double> Player::leadOf(const Channel& channel, const Recorded& whole,
                                     Stamp at) const {
  if (!options_.arm_start) {
    return std::nullopt;
  }
  try {
    Bytes rest = restOf(channel, whole, at, 0);
    topics_.at(channel.topic).scaling->apply(rest, timeline_->rate());
    return options_.arm_start->leadOf(channel, rest, at);
  } catch (const MessageError&) {
    return 0;  // nor can it be sent
  }
}

void Player::giveTime(double seconds, Stamp at) {
  if (seconds <= 0) {
    return;
  }
  lead_end_ = clock_.now().after(static_cast<std::int64_t>(seconds * 1e9));
  changeTimeline([&](Timeline& timeline) { timeline.moveTo(at, lead_end_); });
  shift_ns_.reset();
}

/// What is sent while others are given time gets as much.
void Player::beginWhereJointsAre(const Topic& topic, const Channel& channel, Stamp at,
                                 Bytes& bytes) {
  const bool has_joints = isGoal(channel) || isTrajectoryCommand(channel);
  if (!options_.arm_start || !has_joints || topic.planned->modality != Modality::Body) {
    return;
  }
  if (lead_end_ <= clock_.now()) {
    const double needed = options_.arm_start->leadOf(channel, bytes, at).value_or(0);
    if (needed > 0) sendZeroVelocities();
    giveTime(needed, at);
  }
  const std::int64_t left_ns = std::max<std::int64_t>(0, lead_end_.ns - clock_.now().ns);
  bytes = options_.arm_start->begin(channel, bytes, at, static_cast<double>(left_ns) * 1e-9);
}

Bytes Player::restOf(const Channel& channel, const Recorded& whole, Stamp at,
                     std::int64_t lead_ns) const {
  return remainderOfGoal(channel, whole.bytes, at.ns - whole.at.ns, lead_ns);
}

void Player::sendRest(Topic& topic, const Channel& channel, const Recorded& whole,
                      std::int64_t lead_ns) {
  const Stamp at = timeline_->recorded(clock_.now());
  const std::uint64_t published = topic.report.published;
  try {
    // The lead of an arm that is looked at comes with its start.
    publish(topic, channel, at, restOf(channel, whole, at, options_.arm_start ? 0 : lead_ns), 0,
            &whole);
  } catch (const MessageError& error) {
    topic.report.problem = error.what();
  }
  if (topic.report.published == published && !isStopped()) {
    note("the rest of a motion on " + channel.topic + " was not sent: " + topic.report.problem);
  }
}

void Player::sendVelocityInForce(Topic& topic, Stamp at) {
  const Recorded command = topic.command;
  if (at.ns - command.at.ns < kVelocityInForce && !isZero(velocityOf(command.bytes))) {
    publish(topic, topic.planned->channel, at, command.bytes, 0, &command);
  }
}

void Player::followRate(double rate) {
  const bool is_moving = !timeline_->isPaused();
  if (is_moving) forgetSteps();
  needs_lead_ = needs_lead_ || clock_.now() < lead_end_ || isHeldByGoal();
  if (is_moving) {
    lookAtHaltedJoints();
    sendCancels(goals_.suspendOpen());
  }
  changeTimeline([&](Timeline& timeline) { timeline.setRate(rate, clock_.now()); });
  if (is_moving) proceed();
}

/// False: nothing is left.
bool Player::step() {
  const auto next = lanes_->front(timeline_->rate(), std::nullopt);
  if (!next) {
    return false;
  }
  leapTo(next->due());
  played_until_ = next->due();
  const Channel& channel = channelOf(next->message->channel);
  Message message = next->lane->pop();
  if (Topic* topic = topicOf(channel)) {
    publish(*topic, channel, message.received, std::move(message.bytes), 0);
  }
  return true;
}

}  // namespace afterglow::replay
