#include "nodes/tools/robot_namespace.hpp"

#include <ros/init.h>
#include <ros/param.h>
#include <ros/this_node.h>

#include <cstdlib>

#include "replay/messages/robot_names.hpp"
#include "replay/store/store.hpp"

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

void refuseStorePassword(const ros::NodeHandle& private_node, const std::string& store) {
  try {
    replay::refusePassword("~store", store);
  } catch (const replay::StoreError&) {
    private_node.deleteParam("store");
    throw;
  }
}

}  // namespace afterglow::nodes
