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
#include <std_msgs/String.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "nodes/fetch/fetch_facts.hpp"
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
const std::string kArm = "/arm_with_torso_controller/follow_joint_trajectory";
constexpr double kDegree = 3.14159265358979323846 / 180;

/// Positions of the arm's joints, in the order of kArmWithTorsoJoints; radians, the torso's in m.
using ArmPose = std::vector<double>;

/// The largest joint's distance from where a path, joint by joint a polyline, is nearest.
double distanceFrom(const std::vector<ArmPose>& path, const ArmPose& point) {
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

double farthest(const std::vector<ArmPose>& points, const std::vector<ArmPose>& path) {
  double found = 0;
  for (const ArmPose& point : points) found = std::max(found, distanceFrom(path, point));
  return found;
}

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
    arm_results_ = node_.subscribe(kArm + "/result", 10, &Witness::onResult, this);
    velocities_ = node_.subscribe("/cmd_vel", 1000, &Witness::onVelocity, this);
  }
  void forget() {
    const std::lock_guard<std::mutex> lock(mutex_);
    rise_begin_ = rise_end_ = ros::Time();
    lowest_ = 1;
    was_high_ = false;
    arm_path_.clear();
    succeeded_.clear();
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
    const auto name = std::find(message.name.begin(), message.name.end(), "torso_lift_joint");
    if (name == message.name.end()) return;
    ArmPose arm;
    for (const std::string& joint : kArmWithTorsoJoints) {
      const auto found = std::find(message.name.begin(), message.name.end(), joint);
      arm.push_back(message.position[static_cast<std::size_t>(found - message.name.begin())]);
    }
    if (arm_path_.empty() || arm_path_.back() != arm) arm_path_.push_back(arm);
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
  std::vector<ArmPose> arm_path_;
  ros::NodeHandle node_;
  ros::Subscriber joints_, odometry_, results_, arm_results_, velocities_;
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

struct World {
  World() {
    node = std::make_unique<ros::NodeHandle>();
    node->setParam("/robot_description", fileText("assets/fetch.urdf"));
    robot = start({AFTERGLOW_TEST_FAKE_FETCH_NODE});
    recorder = start({AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + store});
    player = start({AFTERGLOW_TEST_PLAYER_NODE, "_store:=" + store, "_allow_motion:=true",
                    "_longest_stall:=1"});
    spinner.start();
    witness = std::make_unique<Witness>();
  }
  ~World() {
    spinner.stop();
    ros::shutdown();
  }
  static std::unique_ptr<test::NodeProcess> start(const std::vector<std::string>& arguments) {
    return std::make_unique<test::NodeProcess>(arguments);
  }

  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  Graph graph;
  std::unique_ptr<ros::NodeHandle> node;
  std::unique_ptr<test::NodeProcess> robot, recorder, player;
  std::unique_ptr<Witness> witness;
  ros::AsyncSpinner spinner{2};
};

struct ReplayOnRobot : testing::Test {
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() { delete world; }
  ReplayOnRobot() : node(world->node), witness(world->witness) { putBack(); }

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
    const auto eager = World::start(
        {AFTERGLOW_TEST_PLAYER_NODE, "__name:=eager", "replay:=eager_replay",
         "_store:=" + world->store, "_allow_motion:=true", "_to_start:=true", "_longest_stall:=1"});
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

  /// What perform() does; returns the behavior.
  static std::int64_t record(const std::vector<std::string>& topics,
                             const std::function<void()>& perform) {
    StartRecording::Request request;
    request.name = "reach";
    request.topics = topics;
    const auto started = call<StartRecording>("/recorder_node/start_recording", request);
    EXPECT_TRUE(started.success) << started.message;
    perform();
    StopRecording::Request stop;
    stop.outcome = "success";
    EXPECT_TRUE(call<StopRecording>("/recorder_node/stop_recording", stop).success);
    return started.behavior_id;
  }

  static inline World* world = nullptr;
  std::unique_ptr<ros::NodeHandle>& node;
  std::unique_ptr<Witness>& witness;
};

TEST_F(ReplayOnRobot, executesAReplayedGoalTwiceInARowWithoutAJumpAndEndsWithAZeroTwist) {
  const std::int64_t behavior = record({kTorso + "/goal", "/cmd_vel"}, [this] { perform(); });
  ASSERT_TRUE(eventually([&] { return witness->succeeded().size() == 1; }));
  const double recorded_way = driven(), recorded_rise = witness->riseSeconds();

  std::set<std::string> ids = witness->succeeded();
  for (int time = 1; time <= 2; ++time) {
    putBack();
    const double before = driven();
    const ReplayResult result = replay(behavior);
    EXPECT_TRUE(result.completed);
    const auto report = nlohmann::json::parse(result.report);
    EXPECT_EQ(report["goals"]["sent"], 1) << result.report;
    EXPECT_EQ(report["goals"]["succeeded"], 1) << result.report;
    ASSERT_TRUE(eventually([&] { return witness->succeeded().size() == 1; }));
    EXPECT_TRUE(ids.insert(*witness->succeeded().begin()).second)
        << "every goal has an id of its own";
    EXPECT_TRUE(eventually([&] { return std::abs(witness->height() - kHeight) < 0.005; }))
        << witness->height();
    EXPECT_GT(witness->riseSeconds(), 0.8 * recorded_rise) << "it must not jump";
    EXPECT_GT(std::abs(driven() - before), recorded_way / 2) << "it drove as well";
    EXPECT_TRUE(eventually([&] { return witness->lastVelocity().linear.x == 0; }));
    EXPECT_TRUE(
        eventually([&] { return std::abs(witness->odometry().twist.twist.linear.x) < 1e-6; }));
  }
  expectRefusalFromElsewhere(behavior);
  expectWayToTheStart(behavior);
}

// ------------------------------------------------------------------------------------ in the
// middle

control_msgs::FollowJointTrajectoryGoal wave() {
  control_msgs::FollowJointTrajectoryGoal goal;
  goal.trajectory.joint_names = kArmWithTorsoJoints;
  const std::vector<std::pair<double, ArmPose>> way = {
      {0.8, {0.02, 1.0, 1.0, -0.2, 1.5, 0.2, 1.4, 0.3}},
      {1.6, {0.05, 0.5, 0.6, 0.1, 1.2, 0.4, 1.2, 0.5}},
      {2.4, {0.05, 0.2, 0.6, 0.3, 1.0, 0.2, 1.0, 0.2}}};
  for (const auto& [seconds, positions] : way) {
    goal.trajectory.points.emplace_back();
    goal.trajectory.points.back().positions = positions;
    goal.trajectory.points.back().time_from_start = ros::Duration(seconds);
  }
  return goal;
}

TEST_F(ReplayOnRobot, keepsTheArmsPathThroughAPauseInMidTrajectory) {
  const std::int64_t behavior = record({kArm + "/goal"}, [] {
    actionlib::SimpleActionClient<FollowJointTrajectoryAction> arm(kArm, false);
    ASSERT_TRUE(arm.waitForServer(kPatience));
    EXPECT_EQ(arm.sendGoalAndWait(wave()), State::SUCCEEDED);
  });
  const ArmPose end = wave().trajectory.points.back().positions;
  const auto is_there = [&] {
    const std::vector<ArmPose> path = witness->armPath();
    return !path.empty() && distanceFrom({path.back(), path.back()}, end) < 1e-6;
  };
  ASSERT_TRUE(eventually(is_there));
  const std::vector<ArmPose> recorded = witness->armPath();
  putBack();
  actionlib::SimpleActionClient<ReplayAction> client("/replay", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  ReplayGoal goal;
  goal.behavior_id = behavior;
  client.sendGoal(goal);
  ASSERT_TRUE(eventually([&] { return witness->armPath().size() > recorded.size() / 2; }))
      << client.getState().toString() << " " << client.getState().getText();
  ASSERT_TRUE(call<std_srvs::Trigger>("/player_node/pause").success);
  std::size_t places = 0;
  ASSERT_TRUE(eventually([&] {  // it stands: nothing new for a quarter of a second
    const std::size_t before = std::exchange(places, witness->armPath().size());
    ros::WallDuration(0.25).sleep();
    return before == places;
  })) << "a pause stops the arm";
  EXPECT_FALSE(is_there());
  ASSERT_TRUE(call<std_srvs::Trigger>("/player_node/resume").success);
  EXPECT_TRUE(client.waitForResult(kPatience));
  EXPECT_EQ(client.getState(), State::SUCCEEDED) << client.getState().getText();
  ASSERT_TRUE(eventually(is_there));
  EXPECT_LT(farthest(witness->armPath(), recorded), kDegree);
  EXPECT_LT(farthest(recorded, witness->armPath()), kDegree);
}

// --------------------------------------------------------------------------- who is there to
// listen

TEST_F(ReplayOnRobot, movesNobodyWhereARobotOfThatNamespaceIsNotThere) {
  const std::int64_t behavior = record({kTorso + "/goal", "/cmd_vel"}, [this] { perform(); });
  putBack();
  actionlib::SimpleActionClient<ReplayAction> client("/replay", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  ReplayGoal goal;
  goal.behavior_id = behavior;
  goal.prefix = "/robot2";
  goal.wait_for_subscribers = 0.1;
  client.sendGoal(goal);
  ASSERT_TRUE(client.waitForResult(kPatience));
  EXPECT_EQ(client.getState(), State::ABORTED);
  const std::string text = client.getState().getText();
  EXPECT_NE(text.find("nobody listens on /robot2/cmd_vel"), std::string::npos) << text;
  EXPECT_NE(text.find("there is no action server /robot2" + kTorso), std::string::npos) << text;
  EXPECT_LT(std::abs(witness->height()), 1e-6) << "nor the one that is there";
  EXPECT_EQ(witness->odometry().twist.twist.linear.x, 0);
}

TEST_F(ReplayOnRobot, beginsOnAllTopicsTogetherWhenTheLastListenerHasCome) {
  const std::vector<std::string> topics = {"/first", "/second"};
  const std::int64_t behavior = record(topics, [&] {
    std::vector<ros::Publisher> publishers;
    for (const std::string& topic : topics)
      publishers.push_back(node->advertise<std_msgs::String>(topic, 10));
    ASSERT_TRUE(eventually([&] {
      return publishers[0].getNumSubscribers() + publishers[1].getNumSubscribers() == 2;
    }));
    for (int i = 0; i < 5; ++i) {
      for (const ros::Publisher& publisher : publishers) {
        std_msgs::String number;
        number.data = std::to_string(i);
        publisher.publish(number);
      }
      ros::WallDuration(0.05).sleep();
    }
  });
  std::mutex mutex;
  std::map<std::string, std::vector<std::string>> heard;
  const auto listen = [&](const std::string& topic) {
    return node->subscribe<std_msgs::String>(topic, 10, [&, topic](const auto& message) {
      const std::lock_guard<std::mutex> lock(mutex);
      heard[topic].push_back(message->data);
    });
  };
  const ros::Subscriber first = listen("/first");
  actionlib::SimpleActionClient<ReplayAction> client("/replay", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  ReplayGoal goal;
  goal.behavior_id = behavior;
  goal.wait_for_subscribers = 30;
  client.sendGoal(goal);
  ASSERT_TRUE(eventually([&] { return first.getNumPublishers() == 1; })) << "it is ready";
  const ros::Subscriber second = listen("/second");
  ASSERT_TRUE(client.waitForResult(kPatience));
  EXPECT_EQ(client.getState(), State::SUCCEEDED) << client.getState().getText();
  const auto all = [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return heard["/first"].size() == 5 && heard["/second"].size() == 5;
  };
  EXPECT_TRUE(eventually(all)) << heard["/first"].size() << ", " << heard["/second"].size();
  EXPECT_EQ(heard["/first"], heard["/second"]);
}

}  // namespace
}  // namespace afterglow::nodes::replay_on_robot_ros_test
