#include <ros/ros.h>

#include <exception>
#include <iostream>

#include "nodes/player/player_node.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  ros::init(argc, argv, "player_node", ros::init_options::NoSigintHandler);
  catchStopSignals();
  catchShutdownRequests();
  try {
    PlayerNode node(PlayerNodeOptions::read(ros::NodeHandle("~")));
    ros::AsyncSpinner spinner(2);
    spinner.start();
    waitForStop();
    node.close("the player was stopped");
    letMessagesLeave();
    spinner.stop();
  } catch (const std::exception& error) {
    std::cerr << "player_node: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
