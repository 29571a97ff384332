#include "nodes/verbs/transform_question.hpp"

#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <cstdlib>
#include <stdexcept>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

Eigen::Isometry3d askTransform(const std::string& target, const std::string& source,
                               double patience_s) {
  setenv("ROS_MASTER_URI", "http://localhost:11311", 0);  // roscpp ends the process without it
  requireMaster(0, nullptr);                              // roscpp would wait for it forever
  if (!ros::isInitialized()) {
    int argc = 0;
    ros::init(argc, nullptr, "afterglow_calibrate",
              ros::init_options::AnonymousName | ros::init_options::NoRosout);
  }
  const ros::NodeHandle node;
  tf2_ros::Buffer buffer;
  const tf2_ros::TransformListener listener(buffer);
  try {
    // Wall time: with a simulated clock that stands still this must not wait forever.
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(patience_s);
    while (!buffer.canTransform(target, source, ros::Time(0)) && ros::WallTime::now() < end) {
      ros::WallDuration(0.02).sleep();
    }
    return toIsometry(buffer.lookupTransform(target, source, ros::Time(0)).transform);
  } catch (const tf2::TransformException& error) {
    throw std::runtime_error("tf has no transform from '" + source + "' to '" + target +
                             "' after " + std::to_string(static_cast<int>(patience_s)) +
                             " s: " + error.what());
  }
}

}  // namespace afterglow::nodes
