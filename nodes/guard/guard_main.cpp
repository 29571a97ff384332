// afterglow_guard: runs on the robot, and stops it when a player, its machine or the network is
// gone (nodes/README.md).
#include <ros/ros.h>
#include <sched.h>

#include <chrono>
#include <csignal>
#include <exception>
#include <iostream>
#include <thread>

#include "nodes/guard/guard_node.hpp"
#include "nodes/tools/node_help.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace {

/// Before those that make the robot busy, where that is permitted; all threads of this process.
void hurry() {
  sched_param parameters = {};
  parameters.sched_priority = 20;
  if (sched_setscheduler(0, SCHED_FIFO, &parameters) != 0) return;  // it is as it was
}

}  // namespace

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const bool is_helped = answersHelp(
      argc, argv, "afterglow_guard",
      "stops this robot when a player, its machine or the network is gone.", "guard.launch");
  if (is_helped) return 0;
  hurry();
  std::signal(SIGPIPE, SIG_IGN);
  ros::init(argc, argv, "afterglow_guard", ros::init_options::NoSigintHandler);
  // First the robot, then this program, however often it is told to end.
  catchStopSignals(SecondSignal::IsIgnored);
  catchShutdownRequests();
  try {
    while (!ros::master::check() && !isStopRequested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    if (!isStopRequested()) {
      GuardNode guard;
      guard.run();
      letMessagesLeave();
    }
    ros::shutdown();
  } catch (const std::exception& error) {
    std::cerr << "afterglow_guard: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
