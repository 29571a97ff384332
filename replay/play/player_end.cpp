// How a replay ends, and what brings the robot to rest.
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <limits>

#include "replay/motion/goal_remainder.hpp"
#include "replay/play/clearing.hpp"
#include "replay/play/player.hpp"

namespace afterglow::replay {
namespace {

/// All zeros: every number 0, every string empty.
Bytes blankMessage(const Channel& channel) {
  const Schema schema = Schema::parse(channel.type, channel.definition);
  return Bytes(schema.minimumSize(0));
}

}  // namespace

Player::Wake Player::endRound() {
  const Wake arrived = waitForBase();
  if (arrived != Wake::Due) {
    return arrived;
  }
  measureLength();
  sendZeroVelocities();
  const Wake wake = waitForGoals();
  if (wake != Wake::Due) {
    return wake;
  }
  giveUpGoals();
  has_ended_ = options_.keeps_alive;
  const bool is_lit = std::any_of(topics_.begin(), topics_.end(),
                                  [](const auto& entry) { return !entry.second.last.empty(); });
  const bool holds = options_.clear_projection && is_lit && !options_.is_looping;
  const double hold_s = options_.keeps_alive ? std::numeric_limits<double>::infinity()
                        : holds              ? options_.hold_s
                                             : 0;
  const Wake end = waitFor(hold_s, [hold_s] { return hold_s <= 0; });
  has_ended_ = has_ended_ && end != Wake::Moved;
  return end;
}

void Player::measureLength() {
  const SteadyTime end = timeline_ && timeline_->isPaused() ? paused_at_ : clock_.now();
  report_.actual_ns = std::max<std::int64_t>(0, end.ns - first_deadline_.ns - paused_ns_);
}

/// It gives up by itself.
Player::Wake Player::waitForBase() {
  return waitFor(std::numeric_limits<double>::infinity(), [this] {
    return !options_.base_drive || !options_.base_drive->isBusy(plan_.end);
  });
}

Player::Wake Player::waitForGoals() {
  const auto all_done = [this] { return !timeline_->isPaused() && !goals_.hasOpen(); };
  const Wake wake = waitFor(options_.goal_wait_s, all_done);
  if (wake == Wake::Due && !all_done()) {
    note(fmt::format(
        "goals were still under way {:.4g} s after the behavior's end, and were canceled",
        options_.goal_wait_s));
  }
  return wake;
}

void Player::finish() {
  report_.planned_ns =
      static_cast<std::int64_t>(static_cast<double>(plan_.end.ns - plan_.begin.ns) / options_.rate);
  if (timeline_ && report_.actual_ns == 0) {
    measureLength();  // it did not come to the end
  }
  if (timeline_) forgetSteps();
  giveUpGoals();
  sendZeroVelocities();
  if (isStopped()) haltCommands();
  if (options_.clear_projection) clearProjection();
  if (lanes_) addDamage(*lanes_);
  if (!damaged_.empty()) {
    note(std::to_string(damaged_.size()) +
         (damaged_.size() == 1 ? " damaged message was" : " damaged messages were") +
         " left out; afterglow store check names what is damaged");
  }
}

/// Loops and seeks come by the same ones again.
void Player::addDamage(MessageLanes& lanes) {
  for (const DamagedMessage& message : lanes.end()) damaged_.insert(message.sequence);
}

void Player::sendZeroVelocities() {
  if (options_.base_drive) options_.base_drive->rest();
  for (auto& [name, topic] : topics_) sendZeroVelocity(topic);
}

void Player::sendZeroVelocity(const Topic& topic) {
  if (topic.has_moved) {
    trySend(topic.planned->output, blankMessage(topic.planned->channel));
  }
}

void Player::haltCommands() {
  for (auto& [name, topic] : topics_) {
    if (!topic.command.bytes.empty() && !topic.is_velocity) {
      const Channel& channel = topic.planned->channel;
      trySend(topic.planned->output, haltedTrajectory(channel, topic.command.bytes));
    }
  }
}

void Player::sendCancels(const std::vector<GoalBook::Entry>& goals) {
  for (const GoalBook::Entry& goal : goals) {
    trySend(cancelChannel(topicOf(goal.channel)->planned->output), cancelMessage(goal.id));
  }
}

void Player::clearProjection() {
  for (auto& [name, topic] : topics_) {
    if (topic.last.empty()) {
      continue;
    }
    if (const std::optional<Bytes> nothing = clearingMessage(topic.planned->channel, topic.last)) {
      trySend(topic.planned->output, *nothing);
    }
    topic.last.clear();
  }
}

/// At the end one thing that cannot be sent must not keep the others from being sent.
void Player::trySend(const Channel& channel, const Bytes& bytes) {
  try {
    sink_.publish(channel, bytes);
  } catch (const std::exception& error) {
    note(channel.topic + ": " + error.what());
  }
}

void Player::note(const std::string& problem) { report_.notes.push_back(problem); }

}  // namespace afterglow::replay
