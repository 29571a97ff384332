#include "replay/clock/clock.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
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

}  // namespace afterglow::replay
