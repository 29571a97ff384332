#include "nodes/guard/guard_program.hpp"

#include <ros/ros.h>
#include <signal.h>

#include <chrono>
#include <exception>
#include <iostream>
#include <thread>

#include "nodes/tools/node_help.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace afterglow {
namespace nodes {

void beginGuard() {
  goFirst(20);
  ::signal(SIGPIPE, SIG_IGN);
  catchStopSignals(SecondSignal::IsIgnored);  // however often it is told to end
  catchShutdownRequests();
}

int runGuard(int argc, char** argv, const GuardText& text, const std::function<void()>& guard) {
  if (answersHelp(argc, argv, text.name, text.does, text.launch)) return 0;
  beginGuard();
  ros::init(argc, argv, text.name, ros::init_options::NoSigintHandler);
  try {
    while (!ros::master::check() && !isStopRequested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    if (!isStopRequested()) {
      const ros::NodeHandle own;  // with the last one ROS ends
      guard();
    }
    ros::shutdown();
  } catch (const std::exception& error) {
    std::cerr << text.name << ": " << error.what() << "\n";
    return 1;
  }
  return 0;
}

}  // namespace nodes
}  // namespace afterglow
