#include <ros/ros.h>

#include <exception>
#include <iostream>

#include "nodes/speaker/speaker_node.hpp"
#include "nodes/tools/node_help.hpp"
#include "nodes/tools/registration.hpp"
#include "nodes/tools/ros_graph.hpp"

int main(int argc, char** argv) {
  const bool is_helped = afterglow::nodes::answersHelp(
      argc, argv, "speaker_node", "speaks and plays what /robotsound asks for.",
      "speaker.launch");
  if (is_helped) return 0;
  try {
    afterglow::nodes::requireMaster(argc, argv);
    ros::init(argc, argv, "speaker_node");
    afterglow::nodes::SpeakerNode node{ros::NodeHandle(), ros::NodeHandle("~")};
    const afterglow::nodes::Registration registration;
    ros::spin();
    node.stop();
  } catch (const std::exception& error) {
    std::cerr << "speaker_node: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
