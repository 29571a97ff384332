#include "nodes/tools/stop_signal.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>

namespace afterglow {
namespace nodes {
namespace {

enum class Request { None, Signal, Shutdown };

// What a signal handler may touch: an atomic without a lock, and a file descriptor.
std::atomic<Request> request{Request::None};
std::atomic<int> request_fd{-1};
static_assert(ATOMIC_INT_LOCK_FREE == 2, "a signal handler must not wait for a lock");

void note(Request what) {
  Request nothing = Request::None;
  request.compare_exchange_strong(nothing, what);
  const std::uint64_t one = 1;
  if (::write(request_fd, &one, sizeof one) < 0) return;  // it is readable already
}

extern "C" void onStopSignal(int) {
  const int error = errno;
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
  action.sa_handler = onStopSignal;
  action.sa_flags = SA_RESTART;
  if (second == SecondSignal::EndsAtOnce) action.sa_flags |= static_cast<int>(SA_RESETHAND);
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
}

int stopRequestFd() { return request_fd; }

}  // namespace nodes
}  // namespace afterglow
