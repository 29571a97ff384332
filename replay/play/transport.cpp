#include "replay/play/transport.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "replay/play/message_lanes.hpp"

namespace afterglow::replay {

Transport::Transport(const PlayPlan& plan, const PlayOptions& options, Clock& clock)
    : plan_(plan), options_(options), clock_(clock) {
  requests_.pause = options.starts_paused;
}

// --------------------------------------------------------------------------------------- requests

void Transport::request(const std::function<void(Requests&)>& ask) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ask(requests_);
  clock_.wake();
}

void Transport::stop(const std::string& reason) {
  request([&](Requests& requests) {
    if (!requests.stop_reason) requests.stop_reason = reason;
    if (lanes_) lanes_->cancel();
  });
}

void Transport::pause() {
  request([](Requests& requests) { requests.pause = true; });
}

void Transport::resume() {
  request([](Requests& requests) { requests.pause = false; });
}

void Transport::hold(bool holds) {
  request([&](Requests& requests) { requests.hold = holds; });
}

void Transport::halt(bool halts) {
  request([&](Requests& requests) { requests.halt = halts; });
}

void Transport::setRate(double rate) {
  if (const std::string why = whyNoRate(rate); !why.empty()) throw std::runtime_error(why);
  request([&](Requests& requests) { requests.rate = rate; });
}

void Transport::seek(PlaybackTime position) {
  const Stamp to{plan_.behavior.begin.ns + position.ns};
  if (to < plan_.begin || to > plan_.end) {
    throw std::runtime_error(
        fmt::format("{:.4g} s is not within the part that is played", position.seconds()));
  }
  request([&](Requests& requests) { requests.seek = to; });
}

void Transport::playNext(std::uint64_t count) {
  if (!plan_.motionTopics().empty()) {
    throw std::runtime_error("single messages are for light and speech; this moves the robot");
  }
  request([&](Requests& requests) {
    if (!requests.pause) {
      throw std::runtime_error("single messages are played while it is paused");
    }
    requests.steps += count;
  });
}

bool Transport::togglePauseTopics() {
  const std::lock_guard<std::mutex> lock(mutex_);
  has_pause_topics_ = !has_pause_topics_;
  return has_pause_topics_;
}

void Transport::fail(Modality modality, const std::string& why) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ModalityFailures& failures = failures_[modality];
    if (failures.count++ == 0) failures.first = why;
  }
  if (policyOf(options_.on_failure, modality) == OnFailure::Stop) {
    stop(std::string(name(modality)) + " failed: " + why);
  }
}

bool Transport::isPauseWanted() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return requests_.pause;
}

std::optional<std::string> Transport::stopReason() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return requests_.stop_reason;
}

PlayProgress Transport::progress() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  PlayProgress progress;
  progress.rate = requests_.rate.value_or(timeline_ ? timeline_->rate() : options_.rate);
  if (timeline_) {
    const std::int64_t position = timeline_->position(clock_.now()).ns;
    progress.position.ns = std::clamp<std::int64_t>(position, 0, plan_.durationNs());
    progress.is_held = timeline_->isPaused() && requests_.hold && !requests_.stands();
    progress.state = timeline_->isPaused() && !progress.is_held ? PlayProgress::State::Paused
                                                                : PlayProgress::State::Playing;
  }
  return progress;
}

std::map<Modality, ModalityFailures> Transport::failures() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return failures_;
}

// --------------------------------------------------------------------------- the thread that plays

Transport::Orders Transport::takeOrders(bool has_next) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Orders orders;
  orders.stops = requests_.stop_reason.has_value();
  if (orders.stops) {
    return orders;
  }
  orders.rate = std::exchange(requests_.rate, std::nullopt);
  orders.seek = std::exchange(requests_.seek, std::nullopt);
  orders.steps = std::exchange(requests_.steps, 0);
  const bool stands = requests_.stands() || (requests_.hold && has_next);
  orders.pauses = stands && !timeline_->isPaused();
  orders.resumes = !stands && timeline_->isPaused();
  return orders;
}

bool Transport::pausesBefore(std::uint64_t sequence) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!has_pause_topics_ || paused_before_ == sequence) {
    return false;
  }
  paused_before_ = sequence;
  requests_.pause = true;
  return true;
}

void Transport::cancelOnStop(MessageLanes& lanes) {
  const std::lock_guard<std::mutex> lock(mutex_);
  lanes_ = &lanes;
  if (requests_.stop_reason) lanes.cancel();
}

void Transport::enter(Stamp at, SteadyTime when) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!timeline_) {
    timeline_.emplace(plan_.behavior.begin, options_.rate, when);
    if (requests_.stands()) timeline_->pause(when);
  }
  timeline_->setLimit(std::nullopt, when);
  timeline_->moveTo(at, when);
  paused_before_.reset();
}

void Transport::change(const std::function<void(Timeline&)>& change) {
  const std::lock_guard<std::mutex> lock(mutex_);
  change(*timeline_);
}

}  // namespace afterglow::replay
