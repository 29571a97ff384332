#include "nodes/player/live_pose.hpp"

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

/// Listens while it lives; one thread.
class PoseListener {
 public:
  explicit PoseListener(bool asks_base) {
    node_.setCallbackQueue(&queue_);
    joints_ = node_.subscribe<sensor_msgs::JointState>(
        "/joint_states", 100, [this](const auto& message) { onJoints(*message); });
    if (asks_base) transforms_ = std::make_unique<tf2_ros::TransformListener>(buffer_);
  }

  void listen() { queue_.callAvailable(ros::WallDuration(0.02)); }
  bool knows(const PoseQuestion& question) const {
    return (!question.asks_base || pose.base) &&
           std::all_of(question.joints.begin(), question.joints.end(),
                       [this](const auto& joint) { return pose.joints.count(joint) > 0; });
  }
  void lookForBase(const PoseQuestion& question) {
    const std::string map = frameName(question.map), base = frameName(question.base);
    if (!transforms_ || !buffer_.canTransform(map, base, ros::Time(0))) return;
    const Eigen::Isometry3d T_map_base =
        toIsometry(buffer_.lookupTransform(map, base, ros::Time(0)).transform);
    const auto& R = T_map_base.linear();
    pose.base = replay::PlanarPose{T_map_base.translation().x(), T_map_base.translation().y(),
                                   std::atan2(R(1, 0), R(0, 0))};
  }

  replay::StartPose pose;

 private:
  void onJoints(const sensor_msgs::JointState& message) {
    for (std::size_t i = 0; i < std::min(message.name.size(), message.position.size()); ++i) {
      pose.joints[message.name[i]] = message.position[i];
    }
  }

  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber joints_;
  tf2_ros::Buffer buffer_;
  std::unique_ptr<tf2_ros::TransformListener> transforms_;
};

}  // namespace

replay::StartPose askLivePose(const PoseQuestion& question, double patience_s,
                              const std::function<bool()>& is_stopped) {
  PoseListener listener(question.asks_base);
  const Deadline deadline = deadlineIn(patience_s);
  while (!listener.knows(question) && !is_stopped() &&
         std::chrono::steady_clock::now() < deadline) {
    listener.listen();
    listener.lookForBase(question);
  }
  return listener.pose;
}

}  // namespace afterglow::nodes
