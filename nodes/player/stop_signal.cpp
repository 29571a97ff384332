#include "nodes/player/stop_signal.hpp"

#include <ros/ros.h>

#include <chrono>
#include <csignal>
#include <thread>

namespace afterglow::nodes {
namespace {

volatile std::sig_atomic_t is_requested = 0;  // the one thing a signal handler may touch

extern "C" void onStopSignal(int signal) {
  is_requested = 1;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void catchStopSignals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    std::signal(signal, onStopSignal);
  }
}

bool isStopRequested() { return is_requested != 0; }

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

}  // namespace afterglow::nodes
