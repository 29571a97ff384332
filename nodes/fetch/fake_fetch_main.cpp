#include <ros/ros.h>

#include <exception>
#include <iostream>
#include <stdexcept>

#include "nodes/fetch/fake_fetch_node.hpp"
#include "nodes/tools/node_help.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const bool is_helped = answersHelp(
      argc, argv, "fake_fetch_node", "simulates a Fetch without a camera.",
      "fake_fetch.launch");
  if (is_helped) return 0;
  ros::init(argc, argv, "fake_fetch");
  try {
    if (!ros::master::check())
      throw std::runtime_error("no ROS master at " + ros::master::getURI());
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
