#include "nodes/tools/robot_namespace.hpp"

#include <ros/init.h>
#include <ros/param.h>
#include <ros/this_node.h>

#include <cstdlib>

#include "replay/messages/robot_names.hpp"

namespace afterglow::nodes {

std::string rosNamespace() {
  if (ros::isInitialized()) return replay::cleanNamespace(ros::this_node::getNamespace());
  const char* name_space = std::getenv("ROS_NAMESPACE");
  return replay::cleanNamespace(name_space ? name_space : "");
}

std::string robotParameter(const std::string& name_space, const std::string& name) {
  std::string text, scope = name_space;
  while (!ros::param::get(scope + "/" + name, text) && !scope.empty()) {
    scope.resize(scope.rfind('/'));
  }
  return text;
}

}  // namespace afterglow::nodes
