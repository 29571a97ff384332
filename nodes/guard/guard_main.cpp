// afterglow_guard: runs on the robot, and stops it when a player, its machine or the network is
// gone (nodes/README.md).
#include <ros/ros.h>

#include <chrono>
#include <exception>
#include <iostream>
#include <thread>

#include "nodes/guard/guard_node.hpp"
#include "nodes/guard/guard_program.hpp"
#include "nodes/tools/node_help.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const bool is_helped = answersHelp(
      argc, argv, "afterglow_guard",
      "stops this robot when a player, its machine or the network is gone.", "guard.launch");
  if (is_helped) return 0;
  beginGuard();
  ros::init(argc, argv, "afterglow_guard", ros::init_options::NoSigintHandler);
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
