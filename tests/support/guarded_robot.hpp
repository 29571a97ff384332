/// \file
/// Behaviors that move a robot without end, the robot, and what happens to nodes and processes: for
/// tests of what stops it.
#pragma once

#include <actionlib_msgs/GoalID.h>
#include <actionlib_msgs/GoalStatusArray.h>
#include <control_msgs/FollowJointTrajectoryActionGoal.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <ros/network.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sys/types.h>
#include <xmlrpcpp/XmlRpc.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/ros_bytes.hpp"

namespace afterglow::test::guarded {

using Moment = std::chrono::steady_clock::time_point;
inline const std::string kArm = "/arm/follow_joint_trajectory";
constexpr std::int64_t kNsPerMs = 1'000'000, kMemoryBegin = 1'600'000'000'000'000'000;

inline geometry_msgs::Twist forward() {
  geometry_msgs::Twist twist;
  twist.linear.x = 0.2;
  return twist;
}

inline control_msgs::FollowJointTrajectoryActionGoal elbowGoal() {
  control_msgs::FollowJointTrajectoryActionGoal goal;
  goal.goal.trajectory.joint_names = {"elbow"};
  goal.goal.trajectory.points.resize(1);
  goal.goal.trajectory.points[0].positions = {1.0};
  goal.goal.trajectory.points[0].time_from_start = ros::Duration(60);
  return goal;
}

/// Behaviors as they might have been recorded.
class Memory {
 public:
  explicit Memory(const std::string& path)
      : store_(replay::openStore(path, replay::OpenMode::ReadWrite)),
        recording_(store_->addRecording({0, "", "test", ""})) {}

  template <typename Ros>
  void add(const std::string& topic, double at_s, const Ros& message) {
    add(rosChannel<Ros>(topic), at_s, rosBytes(message));
  }
  void add(const replay::Channel& channel, double at_s, const replay::Bytes& bytes) {
    const auto ns = static_cast<std::int64_t>(at_s * 1e9);
    const std::int64_t id = store_->addChannel(recording_, channel);
    store_->append({{id, {begin_ + ns}, sequence_++, {}, bytes}});
    if (channel.topic != "/joint_states") topics_.push_back(channel.topic);
  }
  /// Of what was added since the last one.
  std::int64_t addBehavior(double seconds) {
    replay::Behavior behavior;
    behavior.recording = recording_;
    behavior.name = "reach";
    behavior.begin = {begin_};
    behavior.end = replay::Stamp{begin_ + static_cast<std::int64_t>(seconds * 1e9)};
    behavior.topics = std::exchange(topics_, {});
    begin_ += 1000 * 1000 * kNsPerMs;
    return store_->addBehavior(behavior);
  }

 private:
  std::unique_ptr<replay::Store> store_;
  std::int64_t recording_;
  std::int64_t begin_ = kMemoryBegin;
  std::uint64_t sequence_ = 0;
  std::vector<std::string> topics_;
};

/// The robot: hears velocities, goals and cancels, and notes when.
class Robot {
 public:
  Robot() {
    velocities_ = node_.subscribe("/cmd_vel", 1000, &Robot::onVelocity, this);
    goals_ = node_.subscribe(kArm + "/goal", 10, &Robot::onGoal, this);
    cancels_ = node_.subscribe(kArm + "/cancel", 100, &Robot::onCancel, this);
    statuses_ = node_.advertise<actionlib_msgs::GoalStatusArray>(kArm + "/status", 10, true);
    joints_ = node_.advertise<sensor_msgs::JointState>("/joint_states", 10);
    timer_ = node_.createWallTimer(ros::WallDuration(0.02), &Robot::onTimer, this);
  }
  void forget() {
    const std::lock_guard<std::mutex> lock(mutex_);
    moves_ = reaches_ = false;
    stopped_ = canceled_ = std::nullopt;
  }
  bool isInMotion() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return moves_ && reaches_;
  }
  /// It got a goal.
  bool reaches() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return reaches_;
  }
  bool drives() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return moves_;
  }
  /// When the first zero velocity came after the last other one; and the first cancel.
  std::optional<Moment> stopped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return stopped_;
  }
  std::optional<Moment> canceled() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return canceled_;
  }

 private:
  void onTimer(const ros::WallTimerEvent&) {
    sensor_msgs::JointState state;
    state.name = {"elbow"};
    state.position = {0.1};
    joints_.publish(state);
  }
  void onVelocity(const geometry_msgs::Twist& twist) {
    const std::lock_guard<std::mutex> lock(mutex_);
    moves_ = twist.linear.x != 0;
    if (moves_) stopped_ = std::nullopt;
    if (!moves_ && !stopped_) stopped_ = std::chrono::steady_clock::now();
  }
  void onGoal(const control_msgs::FollowJointTrajectoryActionGoal&) {
    const std::lock_guard<std::mutex> lock(mutex_);
    reaches_ = true;
  }
  void onCancel(const actionlib_msgs::GoalID&) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!canceled_) canceled_ = std::chrono::steady_clock::now();
  }

  mutable std::mutex mutex_;
  bool moves_ = false, reaches_ = false;
  std::optional<Moment> stopped_, canceled_;
  ros::NodeHandle node_;
  ros::Subscriber velocities_, goals_, cancels_;
  ros::Publisher statuses_, joints_;
  ros::WallTimer timer_;
};

inline bool isRegistered(const std::string& node) {
  std::vector<std::string> nodes;
  ros::master::getNodes(nodes);
  return std::count(nodes.begin(), nodes.end(), node) > 0;
}

/// Calls a method of a node's own; false if it is not there.
inline bool callNode(const std::string& node, const char* method, XmlRpc::XmlRpcValue request,
                     XmlRpc::XmlRpcValue& result) {
  XmlRpc::XmlRpcValue question, answer, address;
  question[0] = request[0] = ros::this_node::getName();
  question[1] = node;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::master::execute("lookupNode", question, answer, address, false) ||
      !ros::network::splitURI(address, host, port)) {
    return false;
  }
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  return client.execute(method, request, result);
}

/// As `rosnode kill` does it, and the master when a node of the same name comes.
inline void rosKill(const std::string& node) {
  XmlRpc::XmlRpcValue request, done;
  request[1] = "user request";
  EXPECT_TRUE(callNode(node, "shutdown", request, done)) << node;
}

/// The node of that name is this process: one that died stays registered.
inline bool isNode(const std::string& node, pid_t pid) {
  XmlRpc::XmlRpcValue request, answer;
  return callNode(node, "getPid", request, answer) && answer.size() == 3 &&
         static_cast<int>(answer[2]) == pid;
}

/// The watchdog's process: the player's child.
inline pid_t guardOf(pid_t player) {
  const std::filesystem::path tasks = "/proc/" + std::to_string(player) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks)) {
    pid_t child = 0;
    if (std::ifstream(task.path() / "children") >> child) return child;
  }
  return 0;
}

}  // namespace afterglow::test::guarded
