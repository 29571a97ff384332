#include <ros/ros.h>

#include <exception>
#include <iostream>

#include "nodes/observer/observer_node.hpp"
#include "nodes/tools/node_help.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const bool is_helped = answersHelp(
      argc, argv, "observer_node", "draws the room as a bystander sees it.",
      "observer.launch");
  if (is_helped) return 0;
  try {
    requireMaster(argc, argv);
    ros::init(argc, argv, "observer_node", ros::init_options::NoSigintHandler);
    catchStopSignals();
    const ros::NodeHandle own("~");
    ObserverNode node(ObserverNodeOptions::read(own));
    node.run([] { return isStopRequested() || !ros::ok(); });
  } catch (const std::exception& error) {
    std::cerr << "observer_node: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
