// Each kind of motion has its stop: a player that is killed or whose goal is aborted, and this
// process as the robot, with controllers that never stop by themselves.
#include <actionlib_msgs/GoalID.h>
#include <actionlib_msgs/GoalStatusArray.h>
#include <control_msgs/FollowJointTrajectoryActionGoal.h>
#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <signal.h>
#include <std_msgs/Float64MultiArray.h>
#include <topic_tools/shape_shifter.h>

#include <chrono>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/guarded_robot.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_bytes.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::motion_kinds_ros_test {
namespace {

using test::rosBytes;
using test::rosChannel;
using test::eventually;
using Moment = std::chrono::steady_clock::time_point;

const std::string kDrive = "/ackermann_cmd", kGroup = "/joint_group_vel_controller/command",
                  kTarget = "/move_base_simple/goal", kCancel = "/move_base/cancel",
                  kArm = "/arm_controller/follow_joint_trajectory",
                  kArmCommand = "/arm_controller/command";
/// What it takes is a few ms; a machine may have other things to do.
constexpr std::chrono::milliseconds kInTime(250);

/// ackermann_msgs/AckermannDrive, which need not be installed.
replay::Bytes drive(float steering, float speed) {
  const float numbers[] = {steering, 0, speed, 0, 0};
  replay::Bytes bytes(sizeof(numbers));
  std::memcpy(bytes.data(), numbers, sizeof(numbers));
  return bytes;
}

replay::Channel driveChannel() {
  return {kDrive, "ackermann_msgs/AckermannDrive", std::string(32, 'a'),
          "float32 steering_angle\nfloat32 steering_angle_velocity\nfloat32 speed\n"
          "float32 acceleration\nfloat32 jerk\n",
          false, "/recorded"};
}

replay::Bytes group(const std::vector<double>& velocities) {
  std_msgs::Float64MultiArray message;
  message.data = velocities;
  return rosBytes(message);
}

/// Hears whatever is sent, and when.
class Robot {
 public:
  Robot() {
    for (const std::string& topic : {kDrive, kGroup, kTarget, kCancel, kArm + "/goal",
                                     kArm + "/cancel", kArmCommand}) {
      listen(topic);
    }
    statuses_ = node_.advertise<actionlib_msgs::GoalStatusArray>(kArm + "/status", 10, true);
    joints_ = node_.advertise<sensor_msgs::JointState>("/joint_states", 10);
    timer_ = node_.createWallTimer(ros::WallDuration(0.02), [this](const ros::WallTimerEvent&) {
      sensor_msgs::JointState state;
      state.name = {"elbow"};
      state.position = {0.1};
      joints_.publish(state);
    });
  }
  /// When these bytes were heard first; empty: not yet.
  std::optional<Moment> heard(const std::string& topic, const replay::Bytes& bytes) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto all = heard_.find(topic);
    if (all == heard_.end()) return std::nullopt;
    for (const auto& [at, message] : all->second) {
      if (message == bytes) return at;
    }
    return std::nullopt;
  }
  /// The last bytes.
  replay::Bytes last(const std::string& topic) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto all = heard_.find(topic);
    return all == heard_.end() ? replay::Bytes() : all->second.back().second;
  }
  /// The last goal of the arm ends so.
  void endGoal(std::uint8_t status) {
    replay::Bytes bytes = last(kArm + "/goal");
    control_msgs::FollowJointTrajectoryActionGoal goal;
    ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::deserialize(stream, goal);
    actionlib_msgs::GoalStatusArray statuses;
    statuses.status_list.resize(1);
    statuses.status_list[0].goal_id = goal.goal_id;
    statuses.status_list[0].status = status;
    statuses_.publish(statuses);
  }

 private:
  void listen(const std::string& topic) {
    using Event = ros::MessageEvent<const topic_tools::ShapeShifter>;
    ros::SubscribeOptions options;
    const auto take = [this, topic](const Event& event) {
      replay::Bytes bytes(event.getMessage()->size());
      ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
      event.getMessage()->write(stream);
      const std::lock_guard<std::mutex> lock(mutex_);
      heard_[topic].emplace_back(std::chrono::steady_clock::now(), std::move(bytes));
    };
    options.initByFullCallbackType<const Event&>(topic, 1000, take);
    subscribers_.push_back(node_.subscribe(options));
  }

  mutable std::mutex mutex_;
  std::map<std::string, std::vector<std::pair<Moment, replay::Bytes>>> heard_;
  ros::NodeHandle node_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Publisher statuses_, joints_;
  ros::WallTimer timer_;
};

struct MotionKinds : testing::Test {
  struct World {
    World() {
      spinner.start();
      test::guarded::Memory recording(store);
      for (int i = 0; i < 400; ++i) recording.add(driveChannel(), i * 0.05, drive(0.3F, 0.5F));
      recording.add(rosChannel<std_msgs::Float64MultiArray>(kGroup), 0.1, group({0.1, -0.2}));
      geometry_msgs::PoseStamped target;
      target.pose.orientation.w = 1;
      recording.add(rosChannel<geometry_msgs::PoseStamped>(kTarget), 0.1, rosBytes(target));
      everything = std::to_string(recording.addBehavior(20));
      control_msgs::FollowJointTrajectoryActionGoal goal;
      goal.goal.trajectory.joint_names = {"elbow"};
      goal.goal.trajectory.points.resize(1);
      goal.goal.trajectory.points[0].positions = {1.0};
      goal.goal.trajectory.points[0].time_from_start = ros::Duration(20);
      recording.add(rosChannel<control_msgs::FollowJointTrajectoryActionGoal>(kArm + "/goal"), 0.1,
                    rosBytes(goal));
      reach = std::to_string(recording.addBehavior(20));
      test::writeFile(rules, "stops: {" + kTarget + ": {cancel: " + kCancel + "}}\n");
    }
    test::TestGraph graph;
    test::TempFolder folder;
    std::string store = folder.path("behaviors.db"), rules = folder.path("rules.yaml");
    std::string everything, reach;
    Robot robot;
    ros::AsyncSpinner spinner{2};
  };
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() {
    world->spinner.stop();
    delete world;
    ros::shutdown();
  }
  static std::unique_ptr<test::NodeProcess> play(const std::string& behavior) {
    return std::make_unique<test::NodeProcess>(std::vector<std::string>{
        AFTERGLOW_TEST_COMMAND, "play", behavior, "--store", world->store, "--allow-motion",
        "--any-start", "--open-loop", "--no-scan", "--rules", world->rules, "--no-keys",
        "--longest-stall", "10"});
  }
  static inline World* world = nullptr;
};

TEST_F(MotionKinds, areStoppedByTheWatchdogWhenThePlayerIsKilled) {
  const Robot& robot = world->robot;
  const auto player = play(world->everything);
  ASSERT_TRUE(eventually([&] {
    return robot.heard(kDrive, drive(0.3F, 0.5F)) && robot.heard(kGroup, group({0.1, -0.2})) &&
           !robot.last(kTarget).empty();
  })) << player->log();
  EXPECT_FALSE(robot.heard(kCancel, rosBytes(actionlib_msgs::GoalID())));
  const Moment since = std::chrono::steady_clock::now();
  player->signal(SIGKILL);
  const std::vector<std::pair<std::string, replay::Bytes>> stops{
      {kDrive, drive(0.3F, 0)},
      {kGroup, group({0, 0})},
      {kCancel, rosBytes(actionlib_msgs::GoalID())}};
  for (const auto& [topic, stop] : stops) {
    ASSERT_TRUE(eventually([&, &on = topic, &bytes = stop] {
      return robot.heard(on, bytes).has_value();
    })) << topic << player->log();
    const std::chrono::duration<double, std::milli> taken = *robot.heard(topic, stop) - since;
    std::cout << topic << " after " << taken.count() << " ms\n";
    EXPECT_LT(taken, kInTime) << topic;
    EXPECT_EQ(robot.last(topic), stop);
  }
}

TEST_F(MotionKinds, areRefusedWithoutTheRuleThatStopsThem) {
  test::NodeProcess player({AFTERGLOW_TEST_COMMAND, "play", world->everything, "--store",
                            world->store, "--allow-motion", "--also", kTarget, "--no-keys"});
  EXPECT_EQ(player.exitStatus(), 1);
  EXPECT_NE(player.log().find(kTarget + " (geometry_msgs/PoseStamped) is not played"),
            std::string::npos)
      << player.log();
}

TEST_F(MotionKinds, haltAControllerThatGoesOnWithATrajectoryItHasAborted) {
  Robot& robot = world->robot;
  const auto player = play(world->reach);
  ASSERT_TRUE(eventually([&] { return !robot.last(kArm + "/goal").empty(); })) << player->log();
  EXPECT_TRUE(robot.last(kArmCommand).empty());
  robot.endGoal(actionlib_msgs::GoalStatus::ABORTED);
  EXPECT_EQ(player->exitStatus(), 1);
  EXPECT_TRUE(eventually([&] { return !robot.last(kArmCommand).empty(); })) << player->log();
  EXPECT_EQ(robot.last(kArmCommand), replay::Bytes(24)) << "a trajectory without points";
}

}  // namespace
}  // namespace afterglow::nodes::motion_kinds_ros_test
