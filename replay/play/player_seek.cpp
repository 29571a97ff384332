// How the player begins in the middle of a behavior.
#include <algorithm>
#include <utility>

#include "replay/play/player.hpp"

namespace afterglow::replay {
namespace {

/// The first deadline lies this far ahead, so that the first message is no later than the others.
constexpr std::int64_t kLead = 5'000'000;

}  // namespace

void Player::enter(Stamp at) {
  const SceneAt scene = readScene(at);
  auto lanes = std::make_unique<MessageLanes>(store_, plan_, options_.latency_s, at,
                                              options_.prefetch_bytes);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::swap(lanes_, lanes);
    if (requests_.stop_reason) lanes_->cancel();
  }
  if (lanes) addDamage(*lanes);
  lanes_->fill();
  clearProjection();
  double latency_s = 0;  // what goes out before the first moment needs that time
  for (const auto& [name, topic] : topics_) latency_s = std::max(latency_s, topic.latency_s);
  const std::int64_t lead_ns = options_.is_immediate ? 0 : kLead + earlyNs(latency_s, 1);
  const SteadyTime first = clock_.now().after(lead_ns);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!timeline_) {
      first_deadline_ = first;
      timeline_.emplace(plan_.behavior.begin, options_.rate, first);
      skew_ = Skew(plan_.behavior.begin, first);
      if (requests_.pause) {
        timeline_->pause(first);
        paused_at_ = first;
      }
    }
    timeline_->setLimit(std::nullopt, first);
    timeline_->moveTo(at, first);
  }
  asked_limit_.reset();
  is_goal_limit_ = is_standing_ = false;
  lifted_at_ = next_base_step_ = {};
  if (options_.base_drive) options_.base_drive->enter(at);
  played_until_ = at;
  paused_before_.reset();
  shift_ns_.reset();
  showLight(scene, at);
  setTargets(scene);
  if (!timeline_->isPaused() && !isStopped()) proceed();
}

void Player::moveTo(Stamp to) {
  forgetSteps();
  sendZeroVelocities();
  haltCommands();
  giveUpGoals();
  lead_end_ = {};
  halt_look_ = SteadyTime::forever();
  if (options_.arm_start) options_.arm_start->forgetHalted();
  enter(to);
}

SceneAt Player::readScene(Stamp at) {
  SceneAt scene;
  if (at <= plan_.behavior.begin) {
    return scene;
  }
  const auto cursor =
      store_.messages(plan_.behavior, {plan_.playedTopics(), plan_.behavior.begin, at});
  while (auto message = isStopped() ? std::nullopt : cursor->next()) {
    const Channel& channel = channelOf(message->channel);
    if (const Topic* topic = topicOf(channel)) {
      scene.add(channel, topic->planned->modality, std::move(*message));
    }
  }
  return scene;
}

void Player::showLight(const SceneAt& scene, Stamp at) {
  for (Message& message : scene.light(at)) {
    const Channel& channel = channelOf(message.channel);
    // Each as if it came now: the moment it came at is too far back for tf.
    const Stamp now = options_.has_recorded_time ? message.received : ros_now_();
    const PublishMoment moment{now, now.ns - message.received.ns};
    publishAt(*topicOf(channel), channel, message.received, {{}, message.received},
              std::move(message.bytes), moment, 0);
  }
}

/// Suspended, as by a pause: proceed() sends them, with time to get there.
void Player::setTargets(const SceneAt& scene) {
  for (auto& [name, topic] : topics_) topic.command = {};
  for (Message& message : scene.targets()) {
    const Channel& channel = channelOf(message.channel);
    if (isGoal(channel)) {
      goals_.suspend({channel, std::move(message.bytes), message.received, ""});
    } else {
      topicOf(channel)->command = {std::move(message.bytes), message.received};
    }
  }
  needs_lead_ = true;
}

}  // namespace afterglow::replay
