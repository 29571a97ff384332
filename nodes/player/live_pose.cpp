#include "nodes/player/live_pose.hpp"

#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <thread>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/player/live_joints.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

/// Listens while it lives; one thread.
class PoseListener {
 public:
  explicit PoseListener(const PoseQuestion& question) : joints_(question.joint_topics) {
    if (question.asks_base) transforms_ = std::make_unique<tf2_ros::TransformListener>(buffer_);
  }

  void listen() {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    pose.joints = joints_.positions();
  }
  bool knows(const PoseQuestion& question) const {
    return (!question.asks_base || pose.base) &&
           std::all_of(question.joints.begin(), question.joints.end(),
                       [this](const auto& joint) { return pose.joints.count(joint) > 0; });
  }
  void lookForBase(const PoseQuestion& question) {
    const std::string map = frameName(question.map), base = frameName(question.base);
    if (!transforms_ || !buffer_.canTransform(map, base, ros::Time(0))) return;
    pose.base =
        toPlanarPose(toIsometry(buffer_.lookupTransform(map, base, ros::Time(0)).transform));
  }

  replay::StartPose pose;

 private:
  LiveJoints joints_;
  tf2_ros::Buffer buffer_;
  std::unique_ptr<tf2_ros::TransformListener> transforms_;
};

}  // namespace

replay::StartPose askLivePose(const PoseQuestion& question, double patience_s,
                              const std::function<bool()>& is_stopped) {
  PoseListener listener(question);
  const Deadline deadline = deadlineIn(patience_s);
  while (!listener.knows(question) && !is_stopped() &&
         std::chrono::steady_clock::now() < deadline) {
    listener.listen();
    listener.lookForBase(question);
  }
  return listener.pose;
}

}  // namespace afterglow::nodes
