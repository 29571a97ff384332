/// \file
/// Where the robot's joints are now: /joint_states.
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "replay/motion/arm_start.hpp"

namespace afterglow::nodes {

/// Listens while it lives, in a thread of its own. Each message may have some of the joints. Any
/// thread.
class LiveJoints {
 public:
  LiveJoints();
  ~LiveJoints();
  LiveJoints(const LiveJoints&) = delete;
  LiveJoints& operator=(const LiveJoints&) = delete;

  /// Empty if no message of the last half second has this joint.
  std::optional<replay::LiveJoint> find(const std::string& joint) const;
  /// Of all joints in any message so far.
  std::map<std::string, double> positions() const;

 private:
  struct Told {
    replay::LiveJoint joint;
    std::chrono::steady_clock::time_point at;
  };
  void onJoints(const sensor_msgs::JointState& message);

  mutable std::mutex mutex_;
  std::map<std::string, Told> joints_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  ros::AsyncSpinner spinner_;
};

/// Joints that turn without an end, by the robot_description on the parameter server; none without.
std::set<std::string> continuousJoints();

}  // namespace afterglow::nodes
