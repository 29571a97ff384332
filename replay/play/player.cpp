#include "replay/play/player.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>

#include "replay/motion/velocity.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
/// Later than that and overtaken by the next of its topic: not sent.
constexpr std::int64_t kStale = 2 * kMillisecond;
/// A base that hears nothing stops after so long (0.25 s on a Fetch): an older velocity would start
/// it again at a time of nobody's choosing.
constexpr std::int64_t kVelocityHolds = 250 * kMillisecond;
/// Motion that is later than this is no replay of what happened any more.
constexpr std::int64_t kMotionStalled = 1000 * kMillisecond;
/// ROS time was stepped, or is not the machine's: stamps follow.
constexpr std::int64_t kClockStep = 50 * kMillisecond;

}  // namespace

Player::Player(const Store& store, const PlayPlan& plan, const PlayOptions& options,
               MessageSink& sink, Clock& clock, std::function<Stamp()> ros_now,
               Rewriter::FreshId ids)
    : store_(store),
      plan_(plan),
      options_(options),
      has_motion_(!plan.motionTopics().empty()),
      sink_(sink),
      clock_(clock),
      ros_now_(std::move(ros_now)),
      rewriter_(std::move(ids), plan.rewriting) {
  if (has_motion_ && (options_.is_looping || options_.is_immediate)) {
    throw std::logic_error("the body is not played in a loop, and not at once");
  }
  requests_.pause = options_.starts_paused;
  if (!options_.has_recorded_time) milestones_ = Milestones::read(store_, plan_);
  report_.notes = milestones_.notes;
  for (const PlannedTopic& planned : plan_.topics) {
    if (planned.isPlayed()) {
      const Channel& channel = planned.channel;
      Topic& topic = topics_[channel.topic];
      topic.planned = &planned;
      topic.scaling = std::make_unique<MotionRate>(Schema::parse(channel.type, channel.definition));
      topic.is_velocity = isVelocity(channel);
      topic.is_replacing = isReplacing(channel.type) || topic.is_velocity || isGoal(channel);
      const auto latency = options_.latency_s.find(planned.modality);
      if (latency != options_.latency_s.end()) topic.latency_s = latency->second;
    }
  }
  if (options_.base_drive) topics_.at(options_.base_drive->topic()).is_driven = true;
}

Player::~Player() = default;

// ---------------------------------------------------------------------------------------- playing

PlayReport Player::run() {
  try {
    play();
  } catch (const std::exception& error) {
    stop(error.what());
  }
  finish();
  endWait();
  report_.behavior_id = plan_.behavior.id;
  report_.behavior_name = plan_.behavior.name;
  report_.begin_s = recordedSeconds(plan_.begin);
  report_.rate = options_.rate;
  report_.in_step.is_gated = isGated();
  report_.in_step.skew = skew_.measured();
  if (options_.base_drive) {
    report_.base =
        PlayedBase{options_.base_drive->topic(), "", options_.base_drive->report(), deviation_};
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.failures = failures_;
  report_.is_complete = !requests_.stop_reason || has_ended_;
  report_.reason = report_.is_complete ? "" : *requests_.stop_reason;
  report_.goals = goals_.counts();
  for (const PlannedTopic& planned : plan_.topics) {
    const auto topic = topics_.find(planned.channel.topic);
    const bool is_played = planned.isPlayed() && topic != topics_.end();
    report_.topics.emplace_back(planned, is_played ? topic->second.report : TopicReport{});
    if (is_played) report_.topics.back().first.rewrites = rewriter_.rules(planned.channel);
  }
  return report_;
}

void Player::play() {
  if (topics_.empty()) {
    throw std::runtime_error("no topic of this behavior is to be played");
  }
  enter(plan_.begin);
  std::uint64_t before = published_;
  // A round without messages would be over at once, again and again.
  while (playRound() && options_.is_looping && published_ != before) {
    before = published_;
    moveTo(plan_.begin);
  }
}

/// To the end; false: stopped.
bool Player::playRound() {
  for (;;) {
    const auto next = lanes_->front(timeline_->rate(), timeline_->limit());
    has_next_ = next.has_value();
    const Wake wake =
        next ? waitUntil(next->message->received, next->early_ns) : waitUntil(plan_.end, 0);
    if (wake == Wake::Stopped) return false;
    if (wake == Wake::Moved) continue;
    if (next) {
      if (pausesBefore(*next->message)) continue;
      if (!has_motion_) leapAfterStall(next->due());
      playDue();
    } else if (const Wake end = endRound(); end != Wake::Moved) {
      return end == Wake::Due;
    }
  }
}

void Player::leapAfterStall(Stamp recorded) {
  const std::int64_t late_ns = clock_.now().ns - timeline_->deadline(recorded).ns;
  if (late_ns > kMotionStalled) {
    note("stalled for " + std::to_string(late_ns / kMillisecond) + " ms, and went on from there");
    leapTo(recorded);
  }
}

std::vector<Player::Due> Player::takeDue(SteadyTime now) {
  std::vector<Due> batch;
  std::optional<Stamp> limit = timeline_->limit();
  while (const auto next = lanes_->ready(timeline_->rate(), limit)) {
    const Stamp received = next->message->received;
    const SteadyTime deadline = deadlineOf(received, next->early_ns);
    const Channel& channel = channelOf(next->message->channel);
    const bool pauses = !batch.empty() && options_.pause_topics.count(channel.topic) > 0;
    if (now < deadline || pauses || (limit && received > *limit)) {
      break;
    }
    played_until_ = next->due();
    // A goal that is sent with this batch keeps back what comes after its end.
    const auto milestone = isGated() ? milestones_.of(channel.topic, received) : std::nullopt;
    if (milestone && milestone->is_awaited) {
      const Stamp end{milestone->at.ns - kMilestoneMarginNs};
      limit = limit ? std::min(*limit, end) : end;
    }
    batch.push_back({next->lane->pop(), &channel, topicOf(channel), deadline});
  }
  return batch;
}

void Player::playDue() {
  const SteadyTime now = clock_.now();
  std::vector<Due> batch = takeDue(now);
  for (std::size_t i = 0; i < batch.size() && !isStopped(); ++i) {
    if (!batch[i].topic) {
      continue;
    }
    if (isOvertaken(batch, i, now)) {
      ++batch[i].topic->report.skipped;
    } else {
      send(batch[i]);
    }
  }
}

bool Player::isOvertaken(const std::vector<Due>& batch, std::size_t index, SteadyTime now) const {
  const Due& due = batch[index];
  return due.topic->is_replacing && now.ns - due.deadline.ns > kStale &&
         std::any_of(batch.begin() + static_cast<std::ptrdiff_t>(index) + 1, batch.end(),
                     [&](const Due& later) { return later.topic == due.topic; });
}

void Player::send(Due& due) {
  if (due.topic->is_driven) {
    ++due.topic->report.replaced;
    return;
  }
  const std::int64_t late_ns = clock_.now().ns - due.deadline.ns;
  if (isTooLate(due, late_ns)) {
    ++due.topic->report.skipped;
    return;
  }
  publish(*due.topic, *due.channel, due.message.received, std::move(due.message.bytes), late_ns);
}

bool Player::isTooLate(const Due& due, std::int64_t late_ns) const {
  if (due.topic->is_velocity) {
    return late_ns > kVelocityHolds && !isZero(velocityOf(due.message.bytes));
  }
  if (due.topic->planned->modality == Modality::Body && late_ns > kMotionStalled) {
    throw std::runtime_error("stalled: motion on " + due.channel->topic + " is " +
                             std::to_string(late_ns / kMillisecond) + " ms late");
  }
  return false;
}

void Player::publish(Topic& topic, const Channel& channel, Stamp received, Bytes bytes,
                     std::int64_t late_ns, const Recorded* origin) {
  const bool is_command = topic.is_velocity || isTrajectoryCommand(channel) || isGoal(channel);
  Recorded recorded = origin       ? *origin
                      : is_command ? Recorded{bytes, received}
                                   : Recorded{{}, received};
  const PublishMoment moment =
      momentOf(received, late_ns, earlyNs(topic.latency_s, timeline_->rate()));
  publishAt(topic, channel, received, std::move(recorded), std::move(bytes), moment, late_ns);
}

/// `at`: the moment of the recording that it is sent for.
void Player::publishAt(Topic& topic, const Channel& channel, Stamp at, Recorded recorded,
                       Bytes bytes, const PublishMoment& moment, std::int64_t late_ns) {
  const Modality modality = topic.planned->modality;
  const Stamp recorded_at = recorded.at;
  try {
    if (channel.md5 != topic.planned->channel.md5) {
      throw MessageError("the topic began with another definition");
    }
    if (topic.is_velocity && !isFinite(velocityOf(bytes))) {
      throw MessageError("a velocity that is no number");
    }
    topic.scaling->apply(bytes, timeline_->rate());
    beginWhereJointsAre(topic, channel, at, bytes);
    if (options_.anchor) {
      options_.anchor->anchor(channel, recorded.at, moment, bytes);
    }
    const Rewritten rewritten = rewriter_.rewrite(channel, moment, bytes);
    if (!rewritten.publish) {
      return;
    }
    topic.has_moved = topic.has_moved || topic.is_velocity;
    topic.report.was_heard = sink_.publish(topic.planned->output, bytes);
    noteSent(topic, recorded_at, late_ns);
    if (rewritten.goal && topic.report.was_heard) {
      addGoal({channel, std::move(recorded.bytes), recorded_at, rewritten.goal->id});
    } else if (!rewritten.goal) {
      topic.command = std::move(recorded);
    }
  } catch (const ArmElsewhere& error) {
    ++topic.report.refused;
    topic.report.problem = error.what();
    stop("nothing more is sent on " + topic.planned->output.topic + ": " + error.what());
    return;
  } catch (const std::exception& error) {
    ++topic.report.refused;
    topic.report.problem = error.what();
    if (modality != Modality::Body) fail(modality, channel.topic + ": " + error.what());
    return;
  }
  if (modality != Modality::Body && !topic.report.was_heard) {
    fail(modality, "nobody listened on " + topic.planned->output.topic);
  }
  if (modality == Modality::Ar) {
    topic.last = std::move(bytes);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  ++published_;
}

void Player::noteSent(Topic& topic, Stamp recorded, std::int64_t late_ns) {
  const SteadyTime now = clock_.now();
  // What waited for the body is not late by that.
  const std::int64_t late = std::max<std::int64_t>(0, std::min(late_ns, now.ns - lifted_at_.ns));
  ++topic.report.published;
  topic.report.lateness.add(late);
  topic.report.moments.add(
      {recordedSeconds(recorded), playedSeconds(now), static_cast<double>(late) * 1e-6});
  if (topic.planned->modality != Modality::Body) {
    const SteadyTime effect = now.after(static_cast<std::int64_t>(topic.latency_s * 1e9));
    skew_.add(topic.planned->modality, recorded, effect, timeline_->rate());
  }
}

PublishMoment Player::momentOf(Stamp received, std::int64_t late_ns, std::int64_t early_ns) {
  if (options_.has_recorded_time) {
    return {received, 0};
  }
  const Stamp now = ros_now_();
  const std::int64_t shift = now.ns - late_ns - (received.ns - early_ns);
  // One shift for all, so that stamps that were equal stay equal. Those of what is sent early are
  // no later than now: tf knows no future.
  const bool is_constant = timeline_->rate() == 1.0 && shift_ns_;
  if (!is_constant || std::abs(shift - *shift_ns_) > kClockStep) {
    shift_ns_ = shift;
  }
  return {now, *shift_ns_ - early_ns};
}

const Channel& Player::channelOf(std::int64_t id) {
  const auto known = channels_.find(id);
  return known != channels_.end() ? known->second
                                  : channels_.emplace(id, store_.channel(id)).first->second;
}

Player::Topic* Player::topicOf(const Channel& channel) {
  const auto found = topics_.find(channel.topic);
  return found == topics_.end() ? nullptr : &found->second;
}

}  // namespace afterglow::replay
