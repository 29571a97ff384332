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
  std::string key, text;
  const bool is_there = ros::param::search(name_space.empty() ? "/" : name_space, name, key) &&
                        ros::param::get(key, text);
  return is_there ? text : "";
}

}  // namespace afterglow::nodes
