/// \file
/// A behavior of a simulated robot (robot_facts.hpp), recorded by recorder_node and replayed by
/// player_node, each a process of its own, and what the robot does then.
#pragma once

#include <actionlib/client/simple_action_client.h>
#include <afterglow/ReplayAction.h>
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <control_msgs/FollowJointTrajectoryAction.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Bool.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "replay/motion/planar_pose.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/robots/robot_facts.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

inline const ros::Duration kRobotPatience(20);

template <typename Service>
typename Service::Response callService(const std::string& name,
                                       const typename Service::Request& request = {}) {
  Service service;
  service.request = request;
  EXPECT_TRUE(ros::service::waitForService(name, kRobotPatience)) << name;
  EXPECT_TRUE(ros::service::call(name, service)) << name;
  return service.response;
}

/// What the robot does, seen from outside.
class RobotWitness {
 public:
  RobotWitness() {
    joints_ = node_.subscribe("/joint_states", 200, &RobotWitness::onJoints, this);
    commands_ = node_.subscribe("/robot/commands", 200, &RobotWitness::onCommands, this);
    poses_ = node_.subscribe("/robot/true_pose", 200, &RobotWitness::onPose, this);
  }
  void forget() {
    const std::lock_guard<std::mutex> lock(mutex_);
    fastest_.clear();
    fastest_base_ = 0;
  }
  /// NaN before it is known.
  double joint(const std::string& name) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = positions_.find(name);
    return found != positions_.end() ? found->second : std::nan("");
  }
  replay::PlanarPose pose() const { return locked(pose_); }
  /// Since forget(): of commands of each joint, from cycle to cycle; of the base.
  std::map<std::string, double> fastestCommands() const { return locked(fastest_); }
  double fastestBase() const { return locked(fastest_base_); }
  ros::WallTime lastMoved() const { return locked(last_moved_); }
  bool stands() const { return ros::WallTime::now() - lastMoved() > ros::WallDuration(0.4); }
  bool moves() const { return ros::WallTime::now() - lastMoved() < ros::WallDuration(0.1); }

 private:
  template <typename T>
  T locked(const T& value) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return value;
  }
  void onJoints(const sensor_msgs::JointState& message) {
    constexpr double kStands = 0.003;  // rad/s, m/s
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t i = 0; i < message.name.size(); ++i) {
      positions_[message.name[i]] = message.position[i];
      if (std::abs(message.velocity[i]) > kStands) last_moved_ = ros::WallTime::now();
    }
  }
  void onCommands(const sensor_msgs::JointState& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t i = 0; i < message.name.size(); ++i) {
      double& fastest = fastest_[message.name[i]];
      fastest = std::max(fastest, message.velocity[i]);
    }
  }
  void onPose(const geometry_msgs::PoseStamped& message) {
    const auto& at = message.pose;
    const std::lock_guard<std::mutex> lock(mutex_);
    const replay::PlanarPose now{at.position.x, at.position.y,
                                 2 * std::atan2(at.orientation.z, at.orientation.w)};
    const double gone = distance(pose_, now), turned = replay::wrapAngle(now.yaw - pose_.yaw);
    const double seconds = (message.header.stamp - posed_at_).toSec();
    if (gone > 1e-5 || std::abs(turned) > 1e-5) last_moved_ = ros::WallTime::now();
    // A robot that is put back jumps.
    if (seconds > 0 && gone < 0.1) fastest_base_ = std::max(fastest_base_, gone / seconds);
    pose_ = now;
    posed_at_ = message.header.stamp;
  }

  mutable std::mutex mutex_;
  std::map<std::string, double> positions_, fastest_;
  replay::PlanarPose pose_;
  ros::Time posed_at_;
  double fastest_base_ = 0;
  ros::WallTime last_moved_;
  ros::NodeHandle node_;
  ros::Subscriber joints_, commands_, poses_;
};

using Follower = actionlib::SimpleActionClient<control_msgs::FollowJointTrajectoryAction>;
using Replayer = actionlib::SimpleActionClient<ReplayAction>;

/// A program's one world: roscpp starts once.
class Rehearsal {
 public:
  /// `profile`: what the player is told by `~robot`.
  Rehearsal(const std::string& robot, const std::string& profile,
            const std::vector<std::string>& player_options = {})
      : facts(factsOf(robot)) {
    node = std::make_unique<ros::NodeHandle>();
    robot_ = start({AFTERGLOW_TEST_SIMULATED_ROBOT, robot});
    if (facts.mux) mux_ = start({AFTERGLOW_TEST_SIMULATED_ROBOT, robot, "mux"});
    recorder_ = start({AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + store_});
    std::vector<std::string> player = {AFTERGLOW_TEST_PLAYER_NODE, "_store:=" + store_,
                                       "_allow_motion:=true", "_longest_stall:=1", "_hold:=0",
                                       "_robot:=" + profile};
    // A busy machine may keep the robot's node waiting for longer than the player would allow it.
    if (facts.stop && facts.stop->period > 0) player.push_back("_estop_longest_silence:=5");
    player.insert(player.end(), player_options.begin(), player_options.end());
    player_ = start(player);
    spinner_.start();
    witness = std::make_unique<RobotWitness>();
    press_ = node->advertise<std_msgs::Bool>("/robot/press", 1);
    for (const ControllerFacts& controller : facts.controllers) {
      followers_[controller.name] =
          std::make_unique<Follower>("/" + controller.name + "/follow_joint_trajectory", false);
      EXPECT_TRUE(followers_[controller.name]->waitForServer(kRobotPatience)) << robot_->log();
    }
    replayer = std::make_unique<Replayer>("/replay", false);
    EXPECT_TRUE(replayer->waitForServer(kRobotPatience));
    putBack();
  }
  ~Rehearsal() {
    replayer.reset();
    followers_.clear();
    spinner_.stop();
    ros::shutdown();
  }
  Rehearsal(const Rehearsal&) = delete;
  Rehearsal& operator=(const Rehearsal&) = delete;

  Follower& follower(const std::string& controller) { return *followers_.at(controller); }
  const NodeProcess& player() const { return *player_; }

  void putBack() {
    EXPECT_TRUE(callService<std_srvs::Trigger>("/robot/reset").success);
    EXPECT_TRUE(eventually([this] { return witness->stands() && isAtRest(); }));
    witness->forget();
  }
  bool isAtRest() const {
    const replay::PlanarPose at = witness->pose();
    return distance(at, {}) < 1e-6 && std::abs(at.yaw) < 1e-6 &&
           std::all_of(facts.joints.begin(), facts.joints.end(), [this](const JointFacts& joint) {
             return std::abs(witness->joint(joint.name)) < 1e-6;
           });
  }
  void press(bool is_pressed) {
    EXPECT_TRUE(eventually([this] { return press_.getNumSubscribers() > 0; }));
    std_msgs::Bool word;
    word.data = is_pressed;
    press_.publish(word);
  }

  /// What perform() does; returns the behavior.
  static std::int64_t record(const std::vector<std::string>& topics,
                             const std::function<void()>& perform) {
    StartRecording::Request request;
    request.name = "show";
    request.topics = topics;
    const auto started = callService<StartRecording>("/recorder_node/start_recording", request);
    EXPECT_TRUE(started.success) << started.message;
    perform();
    StopRecording::Request stop;
    stop.outcome = "success";
    EXPECT_TRUE(callService<StopRecording>("/recorder_node/stop_recording", stop).success);
    return started.behavior_id;
  }
  /// Velocities in turn, each for so long, 20 a second, and a zero. Nobody advertises the topic
  /// afterwards, as the player asks for.
  void drive(const std::string& topic,
             const std::vector<std::pair<replay::PlanarVelocity, double>>& velocities) {
    ros::Publisher wheels = node->advertise<geometry_msgs::Twist>(topic, 10);
    ASSERT_TRUE(eventually([&] { return wheels.getNumSubscribers() >= 2; })) << "and the recorder";
    geometry_msgs::Twist twist;
    ros::WallRate rate(20);
    for (const auto& [velocity, seconds] : velocities) {
      twist.linear.x = velocity.forward;
      twist.linear.y = velocity.left;
      twist.angular.z = velocity.turn;
      for (int i = 0; i < seconds * 20; ++i, rate.sleep()) wheels.publish(twist);
    }
    wheels.publish(geometry_msgs::Twist());
    ASSERT_TRUE(eventually([this] { return witness->stands(); }));
  }

  void beginReplay(std::int64_t behavior, const std::vector<std::string>& options = {}) {
    ReplayGoal goal;
    goal.behavior = std::to_string(behavior);
    goal.options = options;
    replayer->sendGoal(goal);
  }
  /// How it ended, in words; empty: well.
  std::string endOfReplay() {
    EXPECT_TRUE(replayer->waitForResult(kRobotPatience)) << player_->log();
    const auto state = replayer->getState();
    if (state == actionlib::SimpleClientGoalState::SUCCEEDED) return "";
    return state.toString() + ": " + state.getText();
  }
  std::string replay(std::int64_t behavior, const std::vector<std::string>& options = {}) {
    beginReplay(behavior, options);
    return endOfReplay();
  }
  std::string report() { return replayer->getResult()->report; }

  /// The replay is paused; returns s until nothing moved any more. The commands of the stop are not
  /// looked at: a controller that holds the measured pose steps back to it, as far as motors lag.
  double pause() {
    expectNoJolt();
    const ros::WallTime since = ros::WallTime::now();
    EXPECT_TRUE(callService<std_srvs::Trigger>("/player_node/pause").success);
    EXPECT_TRUE(eventually([this] { return witness->stands(); }));
    witness->forget();
    return std::max(0.0, (witness->lastMoved() - since).toSec());
  }
  static void resume() {
    EXPECT_TRUE(callService<std_srvs::Trigger>("/player_node/resume").success);
  }

  /// No command was faster than the joint, which a step of some degrees within a cycle would be.
  void expectNoJolt() const {
    const auto fastest = witness->fastestCommands();
    for (const JointFacts& joint : facts.joints) {
      const auto found = fastest.find(joint.name);
      if (found == fastest.end()) continue;
      EXPECT_LT(found->second, 1.05 * joint.speed) << joint.name;
    }
  }

  TestGraph graph;
  const RobotFacts& facts;
  std::unique_ptr<ros::NodeHandle> node;
  std::unique_ptr<RobotWitness> witness;
  std::unique_ptr<Replayer> replayer;

 private:
  static std::unique_ptr<NodeProcess> start(const std::vector<std::string>& arguments) {
    return std::make_unique<NodeProcess>(arguments);
  }

  TempFolder folder_;
  std::string store_ = folder_.path("behaviors.db");
  std::unique_ptr<NodeProcess> robot_, mux_, recorder_, player_;
  std::map<std::string, std::unique_ptr<Follower>> followers_;
  ros::Publisher press_;
  ros::AsyncSpinner spinner_{2};
};

/// Rows of seconds and positions, with the velocities of a spline through them where asked for.
inline control_msgs::FollowJointTrajectoryGoal trajectoryGoal(
    const std::vector<std::string>& joints,
    const std::vector<std::pair<double, std::vector<double>>>& rows, bool has_velocities) {
  control_msgs::FollowJointTrajectoryGoal goal;
  goal.trajectory.joint_names = joints;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    auto& point = goal.trajectory.points.emplace_back();
    point.positions = rows[i].second;
    point.time_from_start = ros::Duration(rows[i].first);
    if (!has_velocities) continue;
    const bool is_inner = i > 0 && i + 1 < rows.size();
    for (std::size_t k = 0; k < joints.size(); ++k) {
      const double slope = is_inner ? (rows[i + 1].second[k] - rows[i - 1].second[k]) /
                                          (rows[i + 1].first - rows[i - 1].first)
                                    : 0;
      point.velocities.push_back(slope);
    }
  }
  return goal;
}

}  // namespace afterglow::test
