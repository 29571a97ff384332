/// \file
/// What a Fetch does, seen from outside, and paths of its arm compared.
#pragma once

#include <control_msgs/FollowJointTrajectoryActionResult.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "nodes/fetch/fetch_facts.hpp"

namespace afterglow::test {

inline const std::string kTorsoAction = "/torso_controller/follow_joint_trajectory";
inline const std::string kArmAction = "/arm_with_torso_controller/follow_joint_trajectory";
inline constexpr double kTorsoHeight = 0.1;  ///< m, to which tests lift it

/// Positions of the arm's joints, in the order of kArmWithTorsoJoints; radians, the torso's in m.
using ArmPose = std::vector<double>;

/// The largest joint's distance from where a path, joint by joint a polyline, is nearest.
inline double distanceFrom(const std::vector<ArmPose>& path, const ArmPose& point) {
  double nearest = 1e9;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const ArmPose &a = path[i - 1], &b = path[i];
    double dot = 0, length = 0, worst = 0;
    for (std::size_t k = 0; k < point.size(); ++k) {
      dot += (point[k] - a[k]) * (b[k] - a[k]);
      length += (b[k] - a[k]) * (b[k] - a[k]);
    }
    const double t = length > 0 ? std::clamp(dot / length, 0., 1.) : 0;
    for (std::size_t k = 0; k < point.size(); ++k)
      worst = std::max(worst, std::abs(point[k] - a[k] - t * (b[k] - a[k])));
    nearest = std::min(nearest, worst);
  }
  return nearest;
}

inline double farthest(const std::vector<ArmPose>& points, const std::vector<ArmPose>& path) {
  double found = 0;
  for (const ArmPose& point : points) found = std::max(found, distanceFrom(path, point));
  return found;
}

/// What the robot does, seen from outside.
class FetchWitness {
 public:
  FetchWitness() {
    joints_ = node_.subscribe("/joint_states", 200, &FetchWitness::onJoints, this);
    odometry_ = node_.subscribe("/odom", 200, &FetchWitness::onOdometry, this);
    results_ = node_.subscribe(kTorsoAction + "/result", 10, &FetchWitness::onResult, this);
    arm_results_ = node_.subscribe(kArmAction + "/result", 10, &FetchWitness::onResult, this);
    poses_ = node_.subscribe("/fake_fetch/true_pose", 200, &FetchWitness::onPose, this);
    velocities_ = node_.subscribe("/cmd_vel", 1000, &FetchWitness::onVelocity, this);
    commands_ = node_.subscribe("/fake_fetch/commands", 1000, &FetchWitness::onCommands, this);
  }
  void forget() {
    const std::lock_guard<std::mutex> lock(mutex_);
    rise_begin_ = rise_end_ = ros::Time();
    lowest_ = 1;
    was_high_ = false;
    arm_path_.clear();
    succeeded_.clear();
    largest_step_ = {};
  }
  double height() const { return locked(height_); }
  /// Since it was as high as it gets.
  double lowest() const { return locked(lowest_); }
  /// Robot time from a tenth of the way up to nine tenths.
  double riseSeconds() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return (rise_end_ - rise_begin_).toSec();
  }
  bool stands() const { return std::abs(locked(last_odometry_).twist.twist.linear.x) < 1e-6; }
  /// Where the base truly is on the map.
  geometry_msgs::Point truth() const { return locked(truth_); }
  geometry_msgs::Twist lastVelocity() const { return locked(last_velocity_); }
  std::set<std::string> succeeded() const { return locked(succeeded_); }
  /// How far a joint's command went within one cycle (10 ms), and which joint's.
  std::pair<double, std::string> largestStep() const { return locked(largest_step_); }
  /// NaN before it is known.
  double joint(const std::string& name) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = positions_.find(name);
    return found != positions_.end() ? found->second : std::nan("");
  }
  /// Where the arm was, each place once.
  std::vector<ArmPose> armPath() const { return locked(arm_path_); }

 private:
  template <typename T>
  T locked(const T& value) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return value;
  }
  void onJoints(const sensor_msgs::JointState& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t i = 0; i < message.name.size(); ++i)
      positions_[message.name[i]] = message.position[i];
    const auto name = std::find(message.name.begin(), message.name.end(), "torso_lift_joint");
    if (name == message.name.end()) return;
    ArmPose arm;
    for (const std::string& joint : nodes::kArmWithTorsoJoints) {
      const auto found = std::find(message.name.begin(), message.name.end(), joint);
      arm.push_back(message.position[static_cast<std::size_t>(found - message.name.begin())]);
    }
    if (arm_path_.empty() || arm_path_.back() != arm) arm_path_.push_back(arm);
    height_ = message.position[static_cast<std::size_t>(name - message.name.begin())];
    if (height_ < 0.95 * kTorsoHeight && was_high_) lowest_ = std::min(lowest_, height_);
    was_high_ = was_high_ || height_ > 0.95 * kTorsoHeight;
    if (rise_begin_.isZero() && height_ > 0.1 * kTorsoHeight) rise_begin_ = message.header.stamp;
    if (rise_end_.isZero() && height_ > 0.9 * kTorsoHeight) rise_end_ = message.header.stamp;
  }
  void onOdometry(const nav_msgs::Odometry& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_odometry_ = message;
  }
  void onPose(const geometry_msgs::PoseStamped& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    truth_ = message.pose.position;
  }
  void onResult(const control_msgs::FollowJointTrajectoryActionResult& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (message.status.status == actionlib_msgs::GoalStatus::SUCCEEDED)
      succeeded_.insert(message.status.goal_id.id);
  }
  void onCommands(const sensor_msgs::JointState& message) {
    constexpr double kCycle = 0.01;
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t i = 0; i < message.name.size(); ++i)
      largest_step_ = std::max(largest_step_, {message.velocity[i] * kCycle, message.name[i]});
  }
  void onVelocity(const geometry_msgs::Twist& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_velocity_ = message;
  }

  mutable std::mutex mutex_;
  double height_ = -1, lowest_ = 1;
  bool was_high_ = false;
  ros::Time rise_begin_, rise_end_;
  nav_msgs::Odometry last_odometry_;
  geometry_msgs::Twist last_velocity_;
  geometry_msgs::Point truth_;
  std::set<std::string> succeeded_;
  std::vector<ArmPose> arm_path_;
  std::map<std::string, double> positions_;
  std::pair<double, std::string> largest_step_;
  ros::NodeHandle node_;
  ros::Subscriber joints_, odometry_, results_, arm_results_, poses_, velocities_, commands_;
};

}  // namespace afterglow::test
