#include "nodes/tools/stop_signal.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <ctime>

namespace afterglow {
namespace nodes {
namespace {

enum class Request { None, Signal, Shutdown };

// coreutils' timeout sends its signal to its child and to its group, to which the child belongs.
constexpr unsigned long kRepeated_ms = 100;

// What a signal handler may touch: atomics without a lock, and a file descriptor.
std::atomic<Request> request{Request::None};
std::atomic<int> request_fd{-1};
std::atomic<unsigned long> first_ms[NSIG];  // by signal; 0: it has not come
static_assert(ATOMIC_INT_LOCK_FREE == 2 && ATOMIC_LONG_LOCK_FREE == 2,
              "a signal handler must not wait for a lock");

void note(Request what) {
  Request nothing = Request::None;
  request.compare_exchange_strong(nothing, what);
  const std::uint64_t one = 1;
  if (::write(request_fd, &one, sizeof one) < 0) return;  // it is readable already
}

bool isSecond(int signal) {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const auto now_ms = static_cast<unsigned long>(now.tv_sec) * 1000 +
                      static_cast<unsigned long>(now.tv_nsec) / 1000000;
  unsigned long first = 0;
  return !first_ms[signal].compare_exchange_strong(first, now_ms) && now_ms > first + kRepeated_ms;
}

extern "C" void onStopSignal(int) {
  const int error = errno;
  note(Request::Signal);
  errno = error;
}

/// The second signal ends the process once its handler, which blocks it, has returned.
extern "C" void onStopSignalOrEnd(int signal) {
  const int error = errno;
  if (isSecond(signal)) {
    ::signal(signal, SIG_DFL);
    ::raise(signal);
  }
  note(Request::Signal);
  errno = error;
}

void openRequestFd() {
  if (request_fd < 0) request_fd = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
}

}  // namespace

void catchStopSignals(SecondSignal second) {
  openRequestFd();
  struct sigaction action {};
  action.sa_handler = second == SecondSignal::EndsAtOnce ? onStopSignalOrEnd : onStopSignal;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}

void noteShutdownRequest() {
  openRequestFd();
  note(Request::Shutdown);
}

bool isStopRequested() { return request != Request::None; }

std::string stopRequest() {
  switch (request) {
    case Request::Signal:
      return "a signal";
    case Request::Shutdown:
      return "a shutdown request";
    case Request::None:
      break;
  }
  return "";
}

void forgetStopRequest() {
  std::uint64_t many = 0;
  if (::read(request_fd, &many, sizeof many) < 0) many = 0;  // nobody waits for it
  request = Request::None;
  for (std::atomic<unsigned long>& first : first_ms) first = 0;
}

int stopRequestFd() { return request_fd; }

}  // namespace nodes
}  // namespace afterglow
