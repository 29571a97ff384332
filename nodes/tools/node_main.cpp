#include "nodes/tools/node_main.hpp"

#include <exception>
#include <iostream>
#include <stdexcept>

#include "nodes/tools/node_help.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace afterglow::nodes {
namespace {

int tell(const NodeText& text, const std::exception& error, int status) {
  std::cerr << text.name << ": " << error.what() << "\n";
  return status;
}

}  // namespace

int runNode(int argc, char** argv, const NodeText& text, const NodeWork& work) {
  if (answersHelp(argc, argv, text.name, text.does, text.launch)) return 0;
  catchStopSignals();
  try {
    if (!awaitMaster(argc, argv, text.name)) return 0;
    const std::string& ros_name = text.ros_name.empty() ? text.name : text.ros_name;
    ros::init(argc, argv, ros_name, ros::init_options::NoSigintHandler);
    catchShutdownRequests();
    const ros::NodeHandle own("~");
    work(own, {argv + 1, argv + argc});
  } catch (const std::invalid_argument& error) {
    return tell(text, error, 2);
  } catch (const std::exception& error) {
    return tell(text, error, 1);
  }
  return 0;
}

}  // namespace afterglow::nodes
