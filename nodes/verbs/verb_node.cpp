#include "nodes/verbs/verb_node.hpp"

#include <ros/console.h>
#include <ros/init.h>
#include <ros/network.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <cstdint>
#include <cstdlib>
#include <stdexcept>

#include "nodes/conversion/geometry_conversion.hpp"
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

Eigen::Isometry3d askTransform(const std::string& target, const std::string& source,
                               double patience_s) {
  return askTransforms({{target, source}}, patience_s).front();
}

std::vector<Eigen::Isometry3d> askTransforms(
    const std::vector<std::pair<std::string, std::string>>& questions, double patience_s) {
  startVerbNode("afterglow_calibrate");
  const ros::NodeHandle node;
  tf2_ros::Buffer buffer;
  const tf2_ros::TransformListener listener(buffer);
  // Wall time: with a simulated clock that stands still this must not wait forever.
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(patience_s);
  std::vector<Eigen::Isometry3d> transforms;
  for (const auto& [target, source] : questions) {
    try {
      while (!buffer.canTransform(target, source, ros::Time(0)) && ros::WallTime::now() < end) {
        ros::WallDuration(0.02).sleep();
      }
      transforms.push_back(
          toIsometry(buffer.lookupTransform(target, source, ros::Time(0)).transform));
    } catch (const tf2::TransformException& error) {
      throw std::runtime_error("tf has no transform from '" + source + "' to '" + target +
                               "' after " + std::to_string(static_cast<int>(patience_s)) +
                               " s: " + error.what());
    }
  }
  return transforms;
}

}  // namespace afterglow::nodes
