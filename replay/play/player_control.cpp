// The player's waits, pauses and end; what it sends while it plays is in player.cpp.
#include <algorithm>
#include <exception>
#include <utility>

#include "replay/play/clearing.hpp"
#include "replay/play/goal_remainder.hpp"
#include "replay/play/player.hpp"

namespace afterglow::replay {
namespace {

/// All zeros: every number 0, every string empty.
Bytes blankMessage(const Channel& channel) {
  const Schema schema = Schema::parse(channel.type, channel.definition);
  return Bytes(schema.minimumSize(0));
}

}  // namespace

bool Player::waitUntil(Stamp recorded) {
  while (followRequests()) {
    if (clock_.sleepUntil(timeline_->deadline(recorded))) {
      return true;
    }
  }
  return false;
}

bool Player::waitFor(double seconds, const std::function<bool()>& is_over) {
  const SteadyTime deadline = clock_.now().after(static_cast<std::int64_t>(seconds * 1e9));
  while (!is_over() && followRequests()) {
    if (clock_.sleepUntil(timeline_->isPaused() ? SteadyTime::forever() : deadline)) {
      break;
    }
  }
  return is_over();
}

/// False: stop.
bool Player::followRequests() {
  bool pauses = false, resumes = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stop_reason_) {
      return false;
    }
    pauses = is_pause_wanted_ && !timeline_->isPaused();
    resumes = !is_pause_wanted_ && timeline_->isPaused();
    if (pauses) timeline_->pause(clock_.now());
    if (resumes) timeline_->resume(clock_.now());
  }
  if (pauses) suspend();
  if (resumes) proceed();
  return true;
}

void Player::suspend() {
  sendZeroVelocities();
  sendCancels(goals_.suspendOpen());
}

void Player::proceed() {
  shift_ns_.reset();
  const Stamp paused_at = timeline_->recorded(clock_.now());
  for (GoalBook::Entry& goal : goals_.takeSuspended()) {
    Topic* topic = topicOf(goal.channel);
    try {
      Bytes rest = remainderOfGoal(goal.channel, goal.recorded, paused_at.ns - goal.recorded_at.ns);
      const std::uint64_t published = topic->report.published;
      publish(*topic, goal.channel, paused_at, std::move(rest), 0);
      if (topic->report.published == published) {
        note("the rest of a goal on " + goal.channel.topic + " was not sent after a pause");
      }
    } catch (const MessageError& error) {
      note("the rest of a goal on " + goal.channel.topic + " is lost: " + error.what());
    }
  }
}

void Player::waitForGoals() {
  const auto all_done = [this] { return !goals_.hasOpen(); };
  if (!waitFor(options_.goal_wait_s, all_done) && !isStopped()) {
    note("goals were still under way " + std::to_string(options_.goal_wait_s) +
         " s after the behavior's end, and were canceled");
  }
}

void Player::finish() {
  report_.planned_ns =
      static_cast<std::int64_t>(static_cast<double>(plan_.durationNs()) / options_.rate);
  if (timeline_ && report_.actual_ns == 0) {
    measureLength();  // it did not come to the end
  }
  sendCancels(goals_.cancelOpen());
  sendZeroVelocities();
  const bool is_lit = std::any_of(topics_.begin(), topics_.end(),
                                  [](const auto& entry) { return !entry.second.last.empty(); });
  if (options_.clear_projection && is_lit) {
    if (timeline_) waitFor(options_.hold_s, [] { return false; });
    clearProjection();
  }
}

void Player::sendZeroVelocities() {
  for (auto& [name, topic] : topics_) {
    if (topic.has_moved) {
      const Channel& channel = topic.planned->channel;
      trySend(channel, blankMessage(channel));
    }
  }
}

void Player::sendCancels(const std::vector<GoalBook::Entry>& goals) {
  for (const GoalBook::Entry& goal : goals) {
    trySend(cancelChannel(goal.channel), cancelMessage(goal.id));
  }
}

void Player::clearProjection() {
  for (const auto& [name, topic] : topics_) {
    if (topic.last.empty()) {
      continue;
    }
    if (const std::optional<Bytes> nothing = clearingMessage(topic.planned->channel, topic.last)) {
      trySend(topic.planned->channel, *nothing);
    }
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
