// A behavior recorded on the fake Fetch and replayed on it, each node a process of its own.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/ReplayAction.h>
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <control_msgs/FollowJointTrajectoryAction.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <std_msgs/Bool.h>
#include <std_msgs/String.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "nodes/fetch/fetch_facts.hpp"
#include "tests/support/fetch_witness.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::replay_on_robot_ros_test {
namespace {

using control_msgs::FollowJointTrajectoryAction;
using test::ArmPose;
using test::eventually;
using test::kArmAction;
using test::kTorsoAction;
using State = actionlib::SimpleClientGoalState;
using Reacher = actionlib::SimpleActionClient<FollowJointTrajectoryAction>;

const ros::Duration kPatience(30);
constexpr double kHeight = test::kTorsoHeight;
constexpr double kSeconds = 3;  // to get there; as fast as the torso can it takes one
constexpr double kDegree = 3.14159265358979323846 / 180;

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
    node->setParam("/robot_description", test::fileBytes("assets/fetch.urdf"));
    robot = start({AFTERGLOW_TEST_FAKE_FETCH_NODE});
    recorder = start({AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + store});
    player = start({AFTERGLOW_TEST_PLAYER_NODE, "_store:=" + store, "_allow_motion:=true",
                    "_longest_stall:=1", "_hold:=0", "_robot:=fetch"});
    spinner.start();
    witness = std::make_unique<test::FetchWitness>();
    // There before a recording begins, so that none of their goals is missed by it.
    torso = std::make_unique<Reacher>(kTorsoAction, false);
    arm = std::make_unique<Reacher>(kArmAction, false);
    EXPECT_TRUE(torso->waitForServer(kPatience) && arm->waitForServer(kPatience));
  }
  ~World() {
    torso.reset();
    arm.reset();
    spinner.stop();
    ros::shutdown();
  }
  static std::unique_ptr<test::NodeProcess> start(const std::vector<std::string>& arguments) {
    return std::make_unique<test::NodeProcess>(arguments);
  }

  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  test::TestGraph graph;
  std::unique_ptr<ros::NodeHandle> node;
  std::unique_ptr<test::NodeProcess> robot, recorder, player;
  std::unique_ptr<test::FetchWitness> witness;
  std::unique_ptr<Reacher> torso, arm;
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
    Reacher& torso = *world->torso;
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
    wheels.publish(geometry_msgs::Twist());
    ASSERT_TRUE(eventually([this] { return witness->stands(); }));
  }

  void putBack() {
    ASSERT_TRUE(call<std_srvs::Trigger>("/fake_fetch/reset").success);
    ASSERT_TRUE(eventually([this] { return std::abs(witness->height()) < 1e-6; }));
    witness->forget();
  }

  static ReplayGoal goalOf(std::int64_t behavior) {
    ReplayGoal goal;
    goal.behavior = std::to_string(behavior);
    return goal;
  }
  /// How it ended; the result by `result`.
  static State tryReplay(const ReplayGoal& goal, ReplayResult* result = nullptr,
                         const std::string& action = "/replay") {
    actionlib::SimpleActionClient<ReplayAction> client(action, false);
    EXPECT_TRUE(client.waitForServer(kPatience));
    client.sendGoal(goal);
    EXPECT_TRUE(client.waitForResult(kPatience));
    if (result) *result = *client.getResult();
    return client.getState();
  }
  ReplayResult replay(const ReplayGoal& goal) {
    ReplayResult result;
    const State state = tryReplay(goal, &result);
    EXPECT_EQ(state, State::SUCCEEDED) << state.getText();
    return result;
  }

  /// The robot is where the behavior has led it.
  void expectRefusalFromElsewhere(std::int64_t id) {
    const State state = tryReplay(goalOf(id));
    EXPECT_EQ(state, State::ABORTED);
    for (const char* part : {"the robot does not stand as it did: torso_lift_joint is 0.1",
                             "then 0.000", "the base is ", "the base has to be brought there"}) {
      EXPECT_NE(state.getText().find(part), std::string::npos) << state.getText();
    }
  }

  /// Only the torso is elsewhere.
  void expectWayToTheStart(std::int64_t id) {
    putBack();
    Reacher& torso = *world->torso;
    torso.sendGoalAndWait(torsoGoal(1.5));
    ASSERT_TRUE(eventually([this] { return std::abs(witness->height() - kHeight) < 0.005; }));
    const auto eager =
        World::start({AFTERGLOW_TEST_PLAYER_NODE, "__name:=eager", "replay:=eager_replay",
                      "_store:=" + world->store, "_allow_motion:=true", "_to_start:=true",
                      "_unchecked_approach:=true", "_longest_stall:=1", "_hold:=0"});
    ReplayResult result;
    ReplayGoal goal = goalOf(id);
    goal.options = {"exclude=/cmd_vel"};
    const State state = tryReplay(goal, &result, "/eager_replay");
    EXPECT_EQ(state, State::SUCCEEDED) << state.getText();
    EXPECT_NE(result.report.find("the robot was moved to the start by " + kTorsoAction + "/goal"),
              std::string::npos)
        << result.report;
    EXPECT_LT(witness->lowest(), 0.02) << "it began where it had begun";
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
  std::unique_ptr<test::FetchWitness>& witness;
};

TEST_F(ReplayOnRobot, reachesTwiceInARowWithoutAJumpAndDrivesToWhereItHadDriven) {
  const std::int64_t behavior = record({kTorsoAction + "/goal", "/cmd_vel"}, [this] { perform(); });
  ASSERT_TRUE(eventually([&] { return witness->succeeded().size() == 1; }));
  const geometry_msgs::Point recorded_end = witness->truth();
  const double recorded_rise = witness->riseSeconds();

  std::set<std::string> ids = witness->succeeded();
  for (const bool drives : {false, true}) {
    putBack();
    ReplayGoal goal = goalOf(behavior);
    if (!drives) goal.options = {"exclude=/cmd_vel"};
    const ReplayResult result = replay(goal);
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
    if (!drives) continue;
    EXPECT_TRUE(report["body"]["base"]["closed_loop"]) << result.report;
    EXPECT_TRUE(eventually([&] { return witness->lastVelocity().linear.x == 0; }));
    EXPECT_TRUE(eventually([&] { return witness->stands(); }));
    EXPECT_GT(std::hypot(recorded_end.x, recorded_end.y), 0.3);
    EXPECT_LT(std::hypot(witness->truth().x - recorded_end.x, witness->truth().y - recorded_end.y),
              0.03)
        << result.report;
  }
  expectRefusalFromElsewhere(behavior);
  expectWayToTheStart(behavior);
}

// ---------------------------------------------------------------------------------- in the middle

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
  const std::int64_t behavior = record({kArmAction + "/goal"}, [] {
    EXPECT_EQ(world->arm->sendGoalAndWait(wave()), State::SUCCEEDED);
  });
  const ArmPose end = wave().trajectory.points.back().positions;
  const auto is_there = [&] {
    const std::vector<ArmPose> path = witness->armPath();
    return !path.empty() && test::distanceFrom({path.back(), path.back()}, end) < 1e-6;
  };
  ASSERT_TRUE(eventually(is_there));
  const std::vector<ArmPose> recorded = witness->armPath();
  putBack();
  actionlib::SimpleActionClient<ReplayAction> client("/replay", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  client.sendGoal(goalOf(behavior));
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
  EXPECT_LT(test::farthest(witness->armPath(), recorded), kDegree);
  EXPECT_LT(test::farthest(recorded, witness->armPath()), kDegree);
}

TEST_F(ReplayOnRobot, takesTheBaseToTheStartOfABehaviorOfJointsAlone) {
  const std::int64_t behavior = record({kTorsoAction + "/goal"}, [] {
    EXPECT_EQ(world->torso->sendGoalAndWait(torsoGoal(kSeconds)), State::SUCCEEDED);
  });
  putBack();
  {
    ros::Publisher wheels = node->advertise<geometry_msgs::Twist>("/cmd_vel", 10);
    geometry_msgs::Twist back;
    back.linear.x = -0.3;
    ASSERT_TRUE(eventually([&] {
      wheels.publish(back);
      return witness->truth().x < -0.5;
    })) << "its way to the start lies ahead, where its scan looks";
    wheels.publish(geometry_msgs::Twist());
    ASSERT_TRUE(eventually([this] { return witness->stands(); }));
  }
  const auto eager =
      World::start({AFTERGLOW_TEST_PLAYER_NODE, "__name:=far", "replay:=far_replay",
                    "_store:=" + world->store, "_allow_motion:=true", "_to_start:=true",
                    "_robot:=fetch", "_longest_stall:=1", "_hold:=0"});
  ReplayResult result;
  const State state = tryReplay(goalOf(behavior), &result, "/far_replay");
  EXPECT_EQ(state, State::SUCCEEDED) << state.getText();
  EXPECT_NE(result.report.find("the base was driven to the start"), std::string::npos)
      << result.report;
  EXPECT_LT(std::hypot(witness->truth().x, witness->truth().y), 0.06);
}

TEST_F(ReplayOnRobot, stopsWhenJointStatesDieWhileAGoalRuns) {
  const std::int64_t behavior = record({kTorsoAction + "/goal"}, [] {
    EXPECT_EQ(world->torso->sendGoalAndWait(torsoGoal(kSeconds)), State::SUCCEEDED);
  });
  putBack();
  ros::Publisher driver = node->advertise<std_msgs::Bool>("/fake_fetch/mute", 1);
  ASSERT_TRUE(eventually([&] { return driver.getNumSubscribers() > 0; }));
  const auto mute = [&](bool is_mute) {
    std_msgs::Bool word;
    word.data = is_mute;
    driver.publish(word);
  };
  actionlib::SimpleActionClient<ReplayAction> client("/replay", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  client.sendGoal(goalOf(behavior));
  ASSERT_TRUE(eventually([&] { return witness->height() > 0.02; }))
      << client.getState().toString() << " " << client.getState().getText();
  mute(true);
  EXPECT_TRUE(client.waitForResult(kPatience));
  mute(false);
  EXPECT_EQ(client.getState(), State::ABORTED);
  EXPECT_EQ(client.getState().getText(),
            "joint states fell silent in motion: nobody tells where torso_lift_joint is");
  double height = -1;
  ASSERT_TRUE(eventually([&] {  // it stands, as the joint states say again
    const double before = std::exchange(height, witness->height());
    ros::WallDuration(0.25).sleep();
    return before == height;
  }));
  EXPECT_LT(witness->height(), 0.8 * kHeight) << "it did not go on unseen";
}

// ------------------------------------------------------------------------- who is there to listen

TEST_F(ReplayOnRobot, movesNobodyWhereARobotOfThatNamespaceIsNotThereNorAtImpossibleRates) {
  const std::int64_t behavior = record({kTorsoAction + "/goal", "/cmd_vel"}, [this] { perform(); });
  putBack();
  ReplayGoal goal = goalOf(behavior);
  goal.options = {"rate=0.05"};
  EXPECT_EQ(tryReplay(goal).getText(), "a body is played at rates from 0.1 to 10");
  goal.options = {"prefix=/robot2", "wait_for_subscribers=0.1"};
  const State state = tryReplay(goal);
  EXPECT_EQ(state, State::ABORTED);
  const std::string text = state.getText();
  EXPECT_NE(text.find("nobody listens on /robot2/cmd_vel"), std::string::npos) << text;
  EXPECT_NE(text.find("there is no action server /robot2" + kTorsoAction), std::string::npos)
      << text;
  EXPECT_LT(std::abs(witness->height()), 1e-6) << "nor the one that is there";
  EXPECT_TRUE(witness->stands());
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
  ReplayGoal goal = goalOf(behavior);
  goal.options = {"also=/first", "also=/second", "wait_for_subscribers=30"};
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
