#include "replay/clock/clock.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <system_error>

namespace afterglow::replay {
namespace {

timespec toTimespec(SteadyTime time) {
  // All zeros would disarm the timer; a deadline in the past fires at once, as it should.
  const std::int64_t ns = std::max<std::int64_t>(1, time.ns);
  return {static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
}

void drain(int descriptor) {
  std::uint64_t count = 0;
  // Both descriptors do not block; nothing to read is fine.
  [[maybe_unused]] const ssize_t got = read(descriptor, &count, sizeof(count));
}

}  // namespace

SteadyClock::SteadyClock()
    : timer_(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)),
      waker_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (timer_ < 0 || waker_ < 0) {
    const int reason = errno;
    if (timer_ >= 0) close(timer_);
    if (waker_ >= 0) close(waker_);
    throw std::system_error(reason, std::generic_category(), "no timer for the player's clock");
  }
}

SteadyClock::~SteadyClock() {
  close(timer_);
  close(waker_);
}

SteadyTime SteadyClock::now() const {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return {static_cast<std::int64_t>(time.tv_sec) * 1'000'000'000 + time.tv_nsec};
}

bool SteadyClock::sleepUntil(SteadyTime deadline) {
  itimerspec setting{};
  setting.it_value = toTimespec(deadline.after(-kSpin));
  timerfd_settime(timer_, TFD_TIMER_ABSTIME, &setting, nullptr);
  pollfd watched[2] = {{timer_, POLLIN, 0}, {waker_, POLLIN, 0}};
  while (poll(watched, 2, -1) < 0 && errno == EINTR) {
  }
  if ((watched[1].revents & POLLIN) != 0) {
    drain(waker_);
    return false;
  }
  drain(timer_);
  while (now() < deadline) {
  }
  return true;
}

void SteadyClock::wake() {
  const std::uint64_t one = 1;
  // Fails only if it is already due to wake.
  [[maybe_unused]] const ssize_t put = write(waker_, &one, sizeof(one));
}

bool BeatingClock::sleepUntil(SteadyTime deadline) {
  watchThisThread();
  for (;;) {
    beatIfDue();
    if (clock_.sleepUntil(deadline)) {
      return true;
    }
    if (is_woken_.exchange(false)) {
      return false;
    }
  }
}

void BeatingClock::wake() {
  is_woken_ = true;
  clock_.wake();
}

void BeatingClock::tick() {
  is_due_ = true;
  clock_.wake();
}

void BeatingClock::beatIfDue() {
  if (sleeper_ == std::this_thread::get_id() && is_due_.exchange(false)) {
    beat_();
  }
}

std::int64_t FollowedClock::tick(Stamp time) {
  std::int64_t step_ns = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (has_ticked_) step_ns = time.ns - time_.ns;
    now_.ns += std::max<std::int64_t>(0, step_ns);
    time_ = time;
    has_ticked_ = true;
  }
  changed_.notify_all();
  return step_ns;
}

bool FollowedClock::hasTicked() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return has_ticked_;
}

Stamp FollowedClock::time() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return time_;
}

SteadyTime FollowedClock::now() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return now_;
}

bool FollowedClock::sleepUntil(SteadyTime deadline) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [&] { return is_woken_ || deadline <= now_; });
  if (is_woken_) {
    is_woken_ = false;
    return false;
  }
  return true;
}

void FollowedClock::wake() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_woken_ = true;
  }
  changed_.notify_all();
}

namespace {

constexpr std::int64_t kSetBack = 1'000'000'000;  // ns; less is a message that was overtaken
constexpr std::int64_t kStep = 50'000'000;        // ns
constexpr std::int64_t kDriftPart = 1000;         // clocks drift by less than so small a part

}  // namespace

std::optional<Stamp> SenderClock::heard(Stamp stamp, Stamp received) {
  const std::int64_t delay_ns = received.ns - stamp.ns;
  const bool begins = count_ == 0 || stamp.ns < stamp_.ns - kSetBack;
  if (!begins && stamp < stamp_) return std::nullopt;
  if (begins || (count_ == 1 && stamp > stamp_)) count_ = begins ? 1 : 2;
  const std::int64_t drift_ns = std::max<std::int64_t>(0, received.ns - received_.ns) / kDriftPart;
  delay_ns_ = begins ? delay_ns : std::min(delay_ns, delay_ns_ + drift_ns);
  stamp_ = stamp;
  received_ = received;
  return Stamp{stamp.ns + delay_ns_};
}

bool ClockStepDetector::hasStepped(Stamp wall, Stamp steady) {
  const std::int64_t apart_ns = wall.ns - steady.ns;
  const bool has_stepped = apart_ns_ && std::abs(apart_ns - *apart_ns_) > kStep;
  apart_ns_ = apart_ns;
  return has_stepped;
}

}  // namespace afterglow::replay
