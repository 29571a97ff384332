// A behavior recorded on the fake Fetch and replayed on it, each node a process of its own.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/ReplayAction.h>
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <control_msgs/FollowJointTrajectoryAction.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::replay_on_robot_ros_test {
namespace {

using control_msgs::FollowJointTrajectoryAction;
using control_msgs::FollowJointTrajectoryActionResult;
using test::eventually;
using State = actionlib::SimpleClientGoalState;

const ros::Duration kPatience(30);
const std::string kTorso = "/torso_controller/follow_joint_trajectory";
constexpr double kHeight = 0.1;  // metres
constexpr double kSeconds = 3;   // to get there; as fast as the torso can it takes one

struct Graph {
  Graph() {
    int argc = 0;
    ros::init(argc, nullptr, "test", ros::init_options::NoSigintHandler);
  }
  test::RosMaster master;
};

/// What the robot does, seen from outside.
class Witness {
 public:
  Witness() {
    joints_ = node_.subscribe("/joint_states", 200, &Witness::onJoints, this);
    odometry_ = node_.subscribe("/odom", 200, &Witness::onOdometry, this);
    results_ = node_.subscribe(kTorso + "/result", 10, &Witness::onResult, this);
    velocities_ = node_.subscribe("/cmd_vel", 1000, &Witness::onVelocity, this);
  }
  void forget() {
    const std::lock_guard<std::mutex> lock(mutex_);
    rise_begin_ = rise_end_ = ros::Time();
    lowest_ = 1;
    was_high_ = false;
  }
  double height() const { return locked(height_); }
  /// Since it was as high as it gets.
  double lowest() const { return locked(lowest_); }
  /// Robot time from a tenth of the way up to nine tenths.
  double riseSeconds() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return (rise_end_ - rise_begin_).toSec();
  }
  nav_msgs::Odometry odometry() const { return locked(last_odometry_); }
  geometry_msgs::Twist lastVelocity() const { return locked(last_velocity_); }
  std::set<std::string> succeeded() const { return locked(succeeded_); }

 private:
  template <typename T>
  T locked(const T& value) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return value;
  }
  void onJoints(const sensor_msgs::JointState& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto name = std::find(message.name.begin(), message.name.end(), "torso_lift_joint");
    if (name == message.name.end()) return;
    height_ = message.position[static_cast<std::size_t>(name - message.name.begin())];
    if (height_ < 0.95 * kHeight && was_high_) lowest_ = std::min(lowest_, height_);
    was_high_ = was_high_ || height_ > 0.95 * kHeight;
    if (rise_begin_.isZero() && height_ > 0.1 * kHeight) rise_begin_ = message.header.stamp;
    if (rise_end_.isZero() && height_ > 0.9 * kHeight) rise_end_ = message.header.stamp;
  }
  void onOdometry(const nav_msgs::Odometry& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_odometry_ = message;
  }
  void onResult(const FollowJointTrajectoryActionResult& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (message.status.status == actionlib_msgs::GoalStatus::SUCCEEDED)
      succeeded_.insert(message.status.goal_id.id);
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
  std::set<std::string> succeeded_;
  ros::NodeHandle node_;
  ros::Subscriber joints_, odometry_, results_, velocities_;
};

std::string fileText(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <typename Service>
typename Service::Response call(const std::string& name,
                                const typename Service::Request& request = {}) {
  Service service;
  service.request = request;
  EXPECT_TRUE(ros::service::waitForService(name, kPatience)) << name;
  EXPECT_TRUE(ros::service::call(name, service)) << name;
  return service.response;
}

struct ReplayOnRobot : testing::Test {
  ReplayOnRobot() {
    node = std::make_unique<ros::NodeHandle>();
    node->setParam("/robot_description", fileText("assets/fetch.urdf"));
    robot = start({AFTERGLOW_TEST_FAKE_FETCH_NODE});
    recorder = start({AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + store});
    player = start({AFTERGLOW_TEST_PLAYER_NODE, "_store:=" + store, "_allow_motion:=true",
                    "_longest_stall:=1"});
    spinner.start();
    witness = std::make_unique<Witness>();
  }
  ~ReplayOnRobot() override {
    spinner.stop();
    ros::shutdown();
  }
  static std::unique_ptr<test::NodeProcess> start(const std::vector<std::string>& arguments) {
    return std::make_unique<test::NodeProcess>(arguments);
  }

  static control_msgs::FollowJointTrajectoryGoal torsoGoal(double seconds) {
    control_msgs::FollowJointTrajectoryGoal goal;
    goal.trajectory.header.stamp = ros::Time::now();
    goal.trajectory.joint_names = {"torso_lift_joint"};
    goal.trajectory.points.resize(1);
    goal.trajectory.points[0].positions = {kHeight};
    goal.trajectory.points[0].time_from_start = ros::Duration(seconds);
    return goal;
  }

  /// Lifts the torso, starting "now", and drives a little meanwhile.
  void perform() {
    actionlib::SimpleActionClient<FollowJointTrajectoryAction> torso(kTorso, false);
    ASSERT_TRUE(torso.waitForServer(kPatience));
    ros::Publisher wheels = node->advertise<geometry_msgs::Twist>("/cmd_vel", 10);
    ASSERT_TRUE(eventually([&] { return wheels.getNumSubscribers() >= 3; }))
        << "robot, recorder and witness";
    torso.sendGoal(torsoGoal(kSeconds));
    geometry_msgs::Twist forward;
    forward.linear.x = 0.2;
    for (ros::WallRate rate(20); torso.getState() != State::SUCCEEDED; rate.sleep()) {
      ASSERT_FALSE(torso.getState().isDone()) << torso.getState().getText();
      wheels.publish(forward);
    }
  }

  void putBack() {
    ASSERT_TRUE(call<std_srvs::Trigger>("/fake_fetch/reset").success);
    ASSERT_TRUE(eventually([this] { return std::abs(witness->height()) < 1e-6; }));
    witness->forget();
  }

  /// How it ended; the result by `result`.
  State tryReplay(std::int64_t id, ReplayResult* result = nullptr,
                  const std::string& action = "/replay") {
    actionlib::SimpleActionClient<ReplayAction> client(action, false);
    EXPECT_TRUE(client.waitForServer(kPatience));
    ReplayGoal goal;
    goal.behavior_id = id;
    client.sendGoal(goal);
    EXPECT_TRUE(client.waitForResult(kPatience));
    if (result) *result = *client.getResult();
    return client.getState();
  }
  ReplayResult replay(std::int64_t id) {
    ReplayResult result;
    const State state = tryReplay(id, &result);
    EXPECT_EQ(state, State::SUCCEEDED) << state.getText();
    return result;
  }

  /// The robot is where the behavior has led it.
  void expectRefusalFromElsewhere(std::int64_t id) {
    const State state = tryReplay(id);
    EXPECT_EQ(state, State::ABORTED);
    for (const char* part : {"the robot does not stand as it did: torso_lift_joint is 0.1",
                             "then 0.000", "the base is ", "the base has to be brought there"}) {
      EXPECT_NE(state.getText().find(part), std::string::npos) << state.getText();
    }
  }

  /// Only the torso is elsewhere.
  void expectWayToTheStart(std::int64_t id) {
    putBack();
    actionlib::SimpleActionClient<FollowJointTrajectoryAction> torso(kTorso, false);
    ASSERT_TRUE(torso.waitForServer(kPatience));
    torso.sendGoalAndWait(torsoGoal(1.5));
    ASSERT_TRUE(eventually([this] { return std::abs(witness->height() - kHeight) < 0.005; }));
    const auto eager =
        start({AFTERGLOW_TEST_PLAYER_NODE, "__name:=eager", "replay:=eager_replay",
               "_store:=" + store, "_allow_motion:=true", "_to_start:=true", "_longest_stall:=1"});
    ReplayResult result;
    const State state = tryReplay(id, &result, "/eager_replay");
    EXPECT_EQ(state, State::SUCCEEDED) << state.getText();
    EXPECT_NE(result.report.find("the robot was moved to the start by " + kTorso + "/goal"),
              std::string::npos)
        << result.report;
    EXPECT_LT(witness->lowest(), 0.02) << "it began where it had begun";
  }

  double driven() const {
    const auto& p = witness->odometry().pose.pose.position;
    return std::hypot(p.x, p.y);
  }

  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  Graph graph;
  std::unique_ptr<ros::NodeHandle> node;
  std::unique_ptr<test::NodeProcess> robot, recorder, player;
  std::unique_ptr<Witness> witness;
  ros::AsyncSpinner spinner{2};
};

TEST_F(ReplayOnRobot, executesAReplayedGoalTwiceInARowWithoutAJumpAndEndsWithAZeroTwist) {
  StartRecording::Request request;
  request.name = "reach";
  request.topics = {kTorso + "/goal", "/cmd_vel"};
  const auto started = call<StartRecording>("/recorder_node/start_recording", request);
  ASSERT_TRUE(started.success) << started.message;
  perform();
  StopRecording::Request stop;
  stop.outcome = "success";
  ASSERT_TRUE(call<StopRecording>("/recorder_node/stop_recording", stop).success);
  ASSERT_TRUE(eventually([&] { return witness->succeeded().size() == 1; }));
  const double recorded_way = driven(), recorded_rise = witness->riseSeconds();

  for (std::size_t time = 1; time <= 2; ++time) {
    putBack();
    const double before = driven();
    const ReplayResult result = replay(started.behavior_id);
    EXPECT_TRUE(result.completed);
    const auto report = nlohmann::json::parse(result.report);
    EXPECT_EQ(report["goals"]["sent"], 1) << result.report;
    EXPECT_EQ(report["goals"]["succeeded"], 1) << result.report;
    ASSERT_TRUE(eventually([&] { return witness->succeeded().size() == 1 + time; }))
        << "every goal has an id of its own";
    EXPECT_TRUE(eventually([&] { return std::abs(witness->height() - kHeight) < 0.005; }))
        << witness->height();
    EXPECT_GT(witness->riseSeconds(), 0.8 * recorded_rise) << "it must not jump";
    EXPECT_GT(std::abs(driven() - before), recorded_way / 2) << "it drove as well";
    EXPECT_TRUE(eventually([&] { return witness->lastVelocity().linear.x == 0; }));
    EXPECT_TRUE(
        eventually([&] { return std::abs(witness->odometry().twist.twist.linear.x) < 1e-6; }));
  }
  expectRefusalFromElsewhere(started.behavior_id);
  expectWayToTheStart(started.behavior_id);
}

}  // namespace
}  // namespace afterglow::nodes::replay_on_robot_ros_test
