#include <ros/ros.h>

#include <exception>
#include <iostream>

#include "nodes/fake_fetch_node.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  ros::init(argc, argv, "fake_fetch");
  try {
    ros::NodeHandle node;
    ros::Time::waitForValid();
    FakeFetchNode robot(readRobotDescription(node), readFakeFetchConfig(ros::NodeHandle("~")));
    ros::AsyncSpinner spinner(2);
    spinner.start();
    ros::waitForShutdown();
  } catch (const std::exception& error) {
    std::cerr << "fake_fetch_node: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
