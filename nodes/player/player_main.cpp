#include <ros/ros.h>

#include <exception>
#include <iostream>

#include "nodes/player/player_node.hpp"
#include "nodes/tools/node_help.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const bool is_helped = answersHelp(
      argc, argv, "player_node", "replays stored behaviors: by action and by service.",
      "player.launch");
  if (is_helped) return 0;
  catchStopSignals();
  try {
    if (!awaitMaster(argc, argv, "player_node")) return 0;
    ros::init(argc, argv, "player_node", ros::init_options::NoSigintHandler);
    catchShutdownRequests();
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
