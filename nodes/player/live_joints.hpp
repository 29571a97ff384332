/// \file
/// The positions of the robot's joints now: /joint_states, or where a robot with a namespace has
/// it.
#pragma once

#include <sensor_msgs/JointState.h>

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "nodes/tools/callback_thread.hpp"
#include "replay/clock/clock.hpp"
#include "replay/motion/arm/arm_start.hpp"
#include "replay/motion/silence_monitor.hpp"

namespace afterglow::nodes {

/// Listens while it lives, in a thread of its own. Each message may have some of the joints. Any
/// thread.
class LiveJoints {
 public:
  /// Listens to one topic or several, each with some of the joints.
  explicit LiveJoints(const std::vector<std::string>& topics = {"/joint_states"});

  /// Empty if nobody has told of this joint, or has fallen silent, in the robot's time.
  std::optional<replay::LiveJoint> find(const std::string& joint) const;
  /// Calls `on_silence` from now on, in the thread of its own, when a joint that is told of falls
  /// silent while it moves, by `moving`.
  void watch(std::function<std::vector<std::string>()> moving,
             std::function<void(const std::string& reason)> on_silence);
  /// Returns the positions of all joints in any message so far.
  std::map<std::string, double> positions() const;

 private:
  struct Told {
    replay::LiveJoint joint;
    replay::SilenceMonitor watch{replay::kJointSilence};  ///< watch by robotNow()
  };
  void onJoints(const sensor_msgs::JointState& message);

  mutable std::mutex mutex_;
  std::map<std::string, Told> joints_;
  ros::SteadyTimer timer_;  ///< watch()'s
  CallbackThread thread_;
};

}  // namespace afterglow::nodes
