#include "nodes/projector/picture_schedule.hpp"

#include <algorithm>

namespace afterglow::nodes {

void EvenPace::add(Duration drawing) {
  last_[next_] = drawing;
  next_ = (next_ + 1) % last_.size();
}

EvenPace::Duration EvenPace::interval() const {
  return usual() > period_ ? *std::max_element(last_.begin(), last_.end()) : period_;
}

EvenPace::Duration EvenPace::usual() const {
  auto sorted = last_;
  const auto middle = sorted.begin() + sorted.size() / 2;
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

using Clock = std::chrono::steady_clock;

PictureSchedule::PictureSchedule(double rate_hz)
    : period_(std::chrono::duration_cast<Clock::duration>(
          std::chrono::duration<double>(1 / rate_hz))),
      pace_(period_) {}

void PictureSchedule::announce() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!has_news_) news_at_ = Clock::now();
    has_news_ = true;
  }
  woken_.notify_all();
}

void PictureSchedule::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_stopped_ = true;
  }
  woken_.notify_all();
}

bool PictureSchedule::isStopped() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return is_stopped_;
}

PictureSchedule::Time PictureSchedule::regularDue(Time drawn_at, bool is_waiting) const {
  if (is_waiting) return drawn_at + period_ / 2;
  // New content often comes at about the same rate as pictures: a regular picture just before it
  // would only delay it.
  const bool was_news = news_drawn_at_ + period_ / 2 > drawn_at;
  return was_news ? drawn_at + period_ + period_ / 4 : drawn_at + period_;
}

std::optional<Clock::duration> PictureSchedule::awaitDue(Time drawn_at, bool is_waiting) {
  pace_.add(Clock::now() - drawn_at);
  std::unique_lock<std::mutex> lock(mutex_);
  if (pace_.interval() > period_) {
    woken_.wait_until(lock, drawn_at + pace_.interval(), [this] { return is_stopped_; });
  }
  const Time regular = regularDue(drawn_at, is_waiting);
  woken_.wait_until(lock, regular, [this] { return is_stopped_ || has_news_; });
  if (!has_news_) return std::nullopt;
  const Time soonest = news_drawn_at_ + period_ / 2;
  // GCC 9 subtracts the clock from what it waits for, which overflows before the first picture.
  if (soonest > Clock::now()) woken_.wait_until(lock, soonest, [this] { return is_stopped_; });
  news_drawn_at_ = Clock::now();
  has_news_ = false;
  return news_drawn_at_ - news_at_;
}

}  // namespace afterglow::nodes
