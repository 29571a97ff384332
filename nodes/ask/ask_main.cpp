#include <ros/ros.h>

#include <exception>
#include <iostream>

#include "nodes/ask/ask_node.hpp"
#include "nodes/tools/node_help.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const bool is_helped =
      answersHelp(argc, argv, "ask_node",
                  "answers questions about what the robot did: by topic and by action.",
                  "ask.launch");
  if (is_helped) return 0;
  catchStopSignals();
  try {
    if (!awaitMaster(argc, argv, "ask_node")) return 0;
    ros::init(argc, argv, "ask_node", ros::init_options::NoSigintHandler);
    const ros::NodeHandle own("~");  // stays: with the last handle ROS shuts down, its log first
    AskNode node(AskNodeOptions::read(own));
    ros::AsyncSpinner spinner(2);
    spinner.start();
    waitForStop();
    letMessagesLeave();
    spinner.stop();
  } catch (const std::exception& error) {
    std::cerr << "ask_node: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
