// A drive of the fake Fetch is replayed where meanwhile something stands and somebody walks.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/ReplayAction.h>
#include <afterglow/ReplayStatus.h>
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/node_process.hpp"
#include "tests/support/ros_graph.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::obstacle_ros_test {
namespace {

using test::eventually;
using Player = actionlib::SimpleActionClient<ReplayAction>;

const ros::Duration kPatience(30);
constexpr double kBase = 0.285;  // m, from the middle of a Fetch's base to its front

struct Thing {
  double x = 0, y = 0, radius = 0.1;
};

/// What stands in the room, where the base truly is, and how near they came.
class Room {
 public:
  explicit Room(ros::NodeHandle& node)
      : obstacles_(node.advertise<geometry_msgs::PoseArray>("/obstacles", 1, true)),
        poses_(node.subscribe("/fake_fetch/true_pose", 100, &Room::onPose, this)),
        odometry_(node.subscribe("/odom", 100, &Room::onOdometry, this)),
        status_(node.subscribe("/player_node/status", 100, &Room::onStatus, this)) {}

  void set(const std::vector<Thing>& things) {
    geometry_msgs::PoseArray array;
    for (const Thing& thing : things) {
      array.poses.emplace_back();
      array.poses.back().position.x = thing.x;
      array.poses.back().position.y = thing.y;
      array.poses.back().position.z = thing.radius;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    things_ = things;
    obstacles_.publish(array);
  }
  double x() const { return locked(place_.x); }
  double y() const { return locked(place_.y); }
  double speed() const { return locked(speed_); }
  std::string status() const { return locked(said_); }
  double nearest() const { return locked(nearest_); }
  bool hasGoneBackInTime() const { return locked(went_back_); }
  std::size_t listeners() const { return obstacles_.getNumSubscribers(); }

 private:
  template <typename T>
  T locked(const T& value) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return value;
  }
  void onPose(const geometry_msgs::PoseStamped& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    place_ = message.pose.position;
    for (const Thing& thing : things_) {
      const double gap = std::hypot(thing.x - place_.x, thing.y - place_.y) - thing.radius - kBase;
      nearest_ = std::min(nearest_, gap);
    }
  }
  void onOdometry(const nav_msgs::Odometry& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    speed_ = message.twist.twist.linear.x;
  }
  void onStatus(const ReplayStatus& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    said_ = message.message;
    went_back_ = went_back_ || (message.behavior_id != 0 && message.position < position_);
    position_ = message.position;
  }

  mutable std::mutex mutex_;
  std::vector<Thing> things_;
  geometry_msgs::Point place_;
  double speed_ = 0, nearest_ = 1e9;
  std::string said_;
  double position_ = 0;
  bool went_back_ = false;
  ros::Publisher obstacles_;
  ros::Subscriber poses_, odometry_, status_;
};

template <typename Service>
typename Service::Response call(const std::string& name, typename Service::Request request = {}) {
  Service service;
  service.request = request;
  EXPECT_TRUE(ros::service::waitForService(name, kPatience)) << name;
  EXPECT_TRUE(ros::service::call(name, service)) << name;
  return service.response;
}

struct Obstacle : test::RosGraph<testing::Test> {
  Obstacle() {
    nh_->setParam("/robot_description", test::fileBytes("assets/fetch.urdf"));
    // This robot knows where it is, at once.
    robot = start({AFTERGLOW_TEST_FAKE_FETCH_NODE, "_localization_distance:=0",
                   "_localization_turn:=0"});
    recorder = start({AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + store});
    player = start({AFTERGLOW_TEST_PLAYER_NODE, "_store:=" + store, "_allow_motion:=true",
                    "_longest_stall:=1", "_hold:=0", "_robot:=fetch",
                    "_localization_noise/position:=0.005", "_localization_noise/yaw:=0.005"});
    room = std::make_unique<Room>(*nh_);
  }
  std::unique_ptr<test::NodeProcess> start(const std::vector<std::string>& arguments) const {
    return std::make_unique<test::NodeProcess>(arguments);
  }

  /// 1.3 m ahead.
  std::int64_t recordDrive() {
    ros::Publisher wheels = nh_->advertise<geometry_msgs::Twist>("/cmd_vel", 10);
    StartRecording::Request request;
    request.name = "drive";
    request.topics = {"/cmd_vel"};
    const auto started = call<StartRecording>("/recorder_node/start_recording", request);
    EXPECT_TRUE(started.success) << started.message;
    EXPECT_TRUE(eventually([&] { return wheels.getNumSubscribers() >= 2; }));
    geometry_msgs::Twist twist;
    twist.linear.x = 0.5;
    for (ros::WallRate rate(30); room->x() < 1.0 && ros::ok(); rate.sleep()) wheels.publish(twist);
    wheels.publish(geometry_msgs::Twist());
    EXPECT_TRUE(eventually([&] { return room->speed() == 0; }));
    StopRecording::Request stop;
    stop.outcome = "success";
    EXPECT_TRUE(call<StopRecording>("/recorder_node/stop_recording", stop).success);
    return started.behavior_id;
  }

  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  std::unique_ptr<test::NodeProcess> robot, recorder, player;
  std::unique_ptr<Room> room;
};

TEST_F(Obstacle, isWaitedForAndWhoWalksThroughIsKeptFree) {
  const std::int64_t behavior = recordDrive();
  const double end_x = room->x(), end_y = room->y();
  EXPECT_TRUE(call<std_srvs::Trigger>("/fake_fetch/reset").success);
  ASSERT_TRUE(eventually([&] { return std::abs(room->x()) < 1e-6 && room->listeners() > 0; }));

  room->set({{0.95, 0.05, 0.1}});
  Player client("/replay", false);
  ASSERT_TRUE(client.waitForServer(kPatience)) << player->log();
  ReplayGoal goal;
  goal.behavior = std::to_string(behavior);
  client.sendGoal(goal);
  ASSERT_TRUE(eventually([&] { return room->status().find("the base waits") == 0; }))
      << player->log() << client.getState().getText();
  EXPECT_NE(room->status().find("something stands 0."), std::string::npos) << room->status();
  ASSERT_TRUE(eventually([&] { return room->speed() == 0; }));
  EXPECT_GT(room->x(), 0.3) << "as near as it may";
  EXPECT_LT(room->x(), 0.95 - 0.1 - kBase - 0.14);

  room->set({});
  ASSERT_TRUE(eventually([&] { return room->x() > 0.5; })) << "it goes on";
  // Somebody crosses the way at 1.2 m/s, a meter ahead.
  Thing leg{room->x() + 1.0, -1.0, 0.08};
  for (ros::WallRate rate(20); leg.y < 1.0; rate.sleep()) {
    leg.y += 0.06;
    room->set({leg});
  }
  room->set({});
  ASSERT_TRUE(client.waitForResult(kPatience)) << player->log();
  EXPECT_EQ(client.getState(), actionlib::SimpleClientGoalState::SUCCEEDED)
      << client.getState().getText();
  EXPECT_GT(room->nearest(), 0.13);
  EXPECT_FALSE(room->hasGoneBackInTime()) << "also while the end is looked at";
  EXPECT_LT(std::hypot(room->x() - end_x, room->y() - end_y), 0.03);
  const auto report = nlohmann::json::parse(client.getResult()->report);
  EXPECT_GT(report["body"]["base"]["waited_for_obstacles_s"], 0.3) << report.dump(1);
  EXPECT_NE(report["notes"].dump().find("the base waited "), std::string::npos)
      << report["notes"].dump(1);
}

}  // namespace
}  // namespace afterglow::nodes::obstacle_ros_test
