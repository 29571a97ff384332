#include "nodes/player/live_pose.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "nodes/player/base_poses.hpp"
#include "nodes/player/live_joints.hpp"
#include "nodes/player/ros_clock.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

/// Listens while it lives; one thread.
class PoseListener {
 public:
  explicit PoseListener(const PoseQuestion& question) : joints_(question.joint_topics) {
    if (question.asks_base) base_.emplace(question.frames);
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
  void lookForBase() {
    if (!base_) return;
    const replay::BaseInput now = base_->look(stampNow());
    if (now.T_map_odom && now.T_odom_base) {
      pose.base = compose(now.T_map_odom->pose, now.T_odom_base->pose);
    }
  }

  replay::StartPose pose;

 private:
  LiveJoints joints_;
  std::optional<BasePoses> base_;
};

}  // namespace

replay::StartPose askLivePose(const PoseQuestion& question, double patience_s,
                              const std::function<bool()>& is_stopped) {
  PoseListener listener(question);
  // A simulation's seconds may be short, and connecting takes real ones.
  const RobotPatience patience(patience_s);
  const Deadline deadline = deadlineIn(patience_s);
  const auto isOver = [&] {
    return patience.isOver() && std::chrono::steady_clock::now() > deadline;
  };
  while (!listener.knows(question) && !is_stopped() && !isOver()) {
    listener.listen();
    listener.lookForBase();
  }
  return listener.pose;
}

}  // namespace afterglow::nodes
