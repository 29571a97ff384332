// What other threads want of the player, and see of it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "replay/play/player.hpp"

namespace afterglow::replay {

void Player::stop(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!requests_.stop_reason) {
    requests_.stop_reason = reason;
  }
  if (lanes_) {
    lanes_->cancel();
  }
  clock_.wake();
}

void Player::pause() {
  const std::lock_guard<std::mutex> lock(mutex_);
  requests_.pause = true;
  clock_.wake();
}

void Player::resume() {
  const std::lock_guard<std::mutex> lock(mutex_);
  requests_.pause = false;
  clock_.wake();
}

void Player::hold(bool holds) {
  const std::lock_guard<std::mutex> lock(mutex_);
  requests_.hold = holds;
  clock_.wake();
}

void Player::setRate(double rate) {
  if (!(rate > 0) || !std::isfinite(rate)) {
    throw std::runtime_error("a rate has to be above 0");
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  requests_.rate = rate;
  clock_.wake();
}

void Player::seek(PlaybackTime position) {
  const Stamp to{plan_.behavior.begin.ns + position.ns};
  if (to < plan_.begin || to > plan_.end) {
    throw std::runtime_error(
        fmt::format("{:.4g} s is not within the part that is played", position.seconds()));
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  requests_.seek = to;
  clock_.wake();
}

void Player::playNext(std::uint64_t count) {
  if (has_motion_) {
    throw std::runtime_error("single messages are for light and speech; this moves the robot");
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!requests_.pause) {
    throw std::runtime_error("single messages are played while it is paused");
  }
  requests_.steps += count;
  clock_.wake();
}

bool Player::togglePauseTopics() {
  const std::lock_guard<std::mutex> lock(mutex_);
  has_pause_topics_ = !has_pause_topics_;
  return has_pause_topics_;
}

void Player::onGoalStatus(const std::string& id, std::uint8_t goal_status) {
  if (goals_.finish(id, outcomeOf(goal_status), clock_.now())) {
    clock_.wake();
  }
}

void Player::fail(Modality modality, const std::string& why) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ModalityFailures& failures = failures_[modality];
    if (failures.count++ == 0) failures.first = why;
  }
  if (policyOf(options_.on_failure, modality) == OnFailure::Stop) {
    stop(std::string(name(modality)) + " failed: " + why);
  }
}

PlayProgress Player::progress() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  PlayProgress progress;
  progress.published = published_;
  progress.rate = requests_.rate.value_or(timeline_ ? timeline_->rate() : options_.rate);
  if (timeline_) {
    const std::int64_t position = timeline_->position(clock_.now()).ns;
    progress.position.ns = std::clamp<std::int64_t>(position, 0, plan_.durationNs());
    progress.is_held = timeline_->isPaused() && requests_.hold && !requests_.pause;
    progress.state = timeline_->isPaused() && !progress.is_held ? PlayProgress::State::Paused
                                                                : PlayProgress::State::Playing;
  }
  return progress;
}

bool Player::isPauseWanted() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return requests_.pause;
}

}  // namespace afterglow::replay
