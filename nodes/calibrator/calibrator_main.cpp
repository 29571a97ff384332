#include <ros/ros.h>

#include <exception>
#include <iostream>

#include "nodes/calibrator/calibrator_window.hpp"
#include "nodes/tools/node_help.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const bool is_helped = answersHelp(
      argc, argv, "calibrator_node", "calibrates a projector with a camera.",
      "calibrator.launch");
  if (is_helped) return 0;
  try {
    requireMaster(argc, argv);
    ros::init(argc, argv, "calibrator_node", ros::init_options::NoSigintHandler);
    catchStopSignals();
    const ros::NodeHandle own("~");  // stays: with the last handle ROS shuts down
    const CalibratorOptions options = CalibratorOptions::read(own);
    CalibratorNode node(options);
    ros::AsyncSpinner spinner(1);
    spinner.start();
    showUntilStopped(node, options);
    letMessagesLeave();
    spinner.stop();
  } catch (const std::exception& error) {
    std::cerr << "calibrator_node: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
