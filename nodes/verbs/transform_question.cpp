#include "nodes/verbs/transform_question.hpp"

#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <stdexcept>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/verbs/verb_node.hpp"

namespace afterglow::nodes {

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
