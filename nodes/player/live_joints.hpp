/// \file
/// Where the robot's joints are now: /joint_states, or where a robot with a namespace has it.
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "replay/clock/clock.hpp"
#include "replay/motion/arm_start.hpp"

namespace afterglow::nodes {

/// Listens while it lives, in a thread of its own. Each message may have some of the joints. Any
/// thread.
class LiveJoints {
 public:
  /// On one topic or several, each with some of the joints.
  explicit LiveJoints(const std::vector<std::string>& topics = {"/joint_states"});
  ~LiveJoints();
  LiveJoints(const LiveJoints&) = delete;
  LiveJoints& operator=(const LiveJoints&) = delete;

  /// Empty if no message of the last half second, in the robot's time, has this joint.
  std::optional<replay::LiveJoint> find(const std::string& joint) const;
  /// Of all joints in any message so far.
  std::map<std::string, double> positions() const;

 private:
  struct Told {
    replay::LiveJoint joint;
    replay::SteadyTime at;  ///< robotNow()
  };
  void onJoints(const sensor_msgs::JointState& message);

  mutable std::mutex mutex_;
  std::map<std::string, Told> joints_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  std::vector<ros::Subscriber> subscribers_;
  ros::AsyncSpinner spinner_;
};

}  // namespace afterglow::nodes
