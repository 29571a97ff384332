#include <cstdio>
#include <exception>

#include "nodes/speaker_node.hpp"

int main(int argc, char** argv) {
  ros::init(argc, argv, "speaker_node");
  if (!ros::master::check()) {
    std::fprintf(stderr, "speaker_node: no ROS master at %s\n", ros::master::getURI().c_str());
    return 1;
  }
  try {
    afterglow::nodes::SpeakerNode node{ros::NodeHandle(), ros::NodeHandle("~")};
    ros::spin();
    node.stop();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "speaker_node: %s\n", error.what());
    return 1;
  }
}
