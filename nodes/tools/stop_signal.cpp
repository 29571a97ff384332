#include "nodes/tools/stop_signal.hpp"

#include <ros/ros.h>
#include <ros/xmlrpc_manager.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <thread>

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

void catchShutdownRequests() {
  openRequestFd();
  // The first binding of a name stays: ros::start() does not replace this one.
  ros::XMLRPCManager::instance()->bind(
      "shutdown", [](XmlRpc::XmlRpcValue&, XmlRpc::XmlRpcValue& answer) {
        note(Request::Shutdown);
        answer = ros::xmlrpc::responseInt(1, "", 0);
      });
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

int stopRequestFd() { return request_fd; }

void waitForStop() {
  while (ros::ok() && !isStopRequested()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

void letMessagesLeave() {
  if (ros::ok()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
}

}  // namespace nodes
}  // namespace afterglow
