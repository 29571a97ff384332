#include "nodes/verbs/verb_node.hpp"

#include <ros/console.h>
#include <ros/init.h>
#include <ros/network.h>

#include <cstdint>
#include <cstdlib>
#include <stdexcept>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

void nameVerbNode(const std::string& name) {
  setenv("ROS_MASTER_URI", "http://localhost:11311", 0);
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(getenv("ROS_MASTER_URI"), host, port)) {
    throw std::runtime_error(std::string("ROS_MASTER_URI is no URI: ") + getenv("ROS_MASTER_URI"));
  }
  int argc = 0;
  ros::init(argc, nullptr, name,
            ros::init_options::NoSigintHandler | ros::init_options::AnonymousName |
                ros::init_options::NoRosout);
}

void startVerbNode(const std::string& name) {
  nameVerbNode(name);
  askMaster(deadlineIn(kMasterPatience));
}

void printWarningsOnly() {
  if (ros::console::set_logger_level(ROSCONSOLE_DEFAULT_NAME, ros::console::levels::Warn)) {
    ros::console::notifyLoggerLevelsChanged();
  }
}

}  // namespace afterglow::nodes
