#include <malloc.h>
#include <ros/ros.h>

#include <exception>
#include <iostream>

#include "nodes/recorder/recorder_node.hpp"
#include "nodes/tools/node_help.hpp"
#include "nodes/tools/registration.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const bool is_helped = answersHelp(
      argc, argv, "recorder_node", "records behaviors into a store: by action and by service.",
      "recorder.launch");
  if (is_helped) return 0;
  // Large messages come and go all the time; without this, each would be new pages from the kernel.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
  catchStopSignals();
  try {
    if (!awaitMaster(argc, argv, "recorder_node")) return 0;
    ros::init(argc, argv, "recorder_node", ros::init_options::NoSigintHandler);
    const ros::NodeHandle own("~");  // stays: with the last handle ROS shuts down, its log first
    const RecorderNodeOptions options = RecorderNodeOptions::read(own);
    RecorderNode node(options);
    const Registration registration;
    // Starting a behavior waits for connections; the others go on meanwhile.
    ros::AsyncSpinner spinner(4);
    spinner.start();
    waitForStop();
    node.close();
    if (const std::string rest = node.sendRest(); !rest.empty()) ROS_WARN_STREAM(rest);
    letMessagesLeave();
    spinner.stop();
  } catch (const std::exception& error) {
    std::cerr << "recorder_node: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
