// Two Fetches on one master, each in a namespace and with a prefix before its frames: one is
// recorded, both replay it. Each node is a process of its own.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/ReplayAction.h>
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <control_msgs/FollowJointTrajectoryAction.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nodes/tools/program.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::several_robots_ros_test {
namespace {

using control_msgs::FollowJointTrajectoryAction;
using test::eventually;
using State = actionlib::SimpleClientGoalState;

const ros::Duration kPatience(30);
constexpr double kHeight = 0.1;  // m, to which the torso is lifted
const std::string kTorso = "/torso_controller/follow_joint_trajectory";

template <typename Service>
typename Service::Response call(const std::string& name,
                                const typename Service::Request& request = {}) {
  Service service;
  service.request = request;
  EXPECT_TRUE(ros::service::waitForService(name, kPatience)) << name;
  EXPECT_TRUE(ros::service::call(name, service)) << name;
  return service.response;
}

/// One of them, with its player, and what is seen of it from outside.
class Fetch {
 public:
  Fetch(std::string name_space, const std::string& tf_prefix, const std::string& store)
      : name_space_(std::move(name_space)) {
    ros::param::set(name_space_ + "/robot_description", test::fileBytes("assets/fetch.urdf"));
    ros::param::set(name_space_ + "/tf_prefix", tf_prefix);
    const std::string here = "__ns:=" + name_space_;
    robot_ = std::make_unique<test::NodeProcess>(
        std::vector<std::string>{AFTERGLOW_TEST_FAKE_FETCH_NODE, here});
    player_ = std::make_unique<test::NodeProcess>(std::vector<std::string>{
        AFTERGLOW_TEST_PLAYER_NODE, here, "_store:=" + store, "_robot:=fetch",
        "_allow_motion:=true", "_longest_stall:=1", "_hold:=0"});
    joints_ = node_.subscribe<sensor_msgs::JointState>(
        name_space_ + "/joint_states", 100, [this](const auto& message) { onJoints(*message); });
    pose_ = node_.subscribe<geometry_msgs::PoseStamped>(
        name_space_ + "/fake_fetch/true_pose", 100, [this](const auto& message) {
          const std::lock_guard<std::mutex> lock(mutex_);
          x_ = message->pose.position.x;
        });
    wheels_ = node_.advertise<geometry_msgs::Twist>(name_space_ + "/cmd_vel", 10);
    torso_ = std::make_unique<Torso>(name_space_ + kTorso, false);
    EXPECT_TRUE(torso_->waitForServer(kPatience)) << robot_->log();
  }

  double height() const { return locked(height_); }
  double x() const { return locked(x_); }
  std::string log() const { return player_->log(); }

  /// Lifts the torso, and drives meanwhile.
  void perform() {
    control_msgs::FollowJointTrajectoryGoal goal;
    goal.trajectory.joint_names = {"torso_lift_joint"};
    goal.trajectory.points.resize(1);
    goal.trajectory.points[0].positions = {kHeight};
    goal.trajectory.points[0].time_from_start = ros::Duration(3);
    ASSERT_TRUE(eventually([&] { return wheels_.getNumSubscribers() >= 2; })) << "robot, recorder";
    torso_->sendGoal(goal);
    geometry_msgs::Twist forward;
    forward.linear.x = 0.2;
    for (ros::WallRate rate(20); torso_->getState() != State::SUCCEEDED; rate.sleep()) {
      ASSERT_FALSE(torso_->getState().isDone()) << torso_->getState().getText();
      wheels_.publish(forward);
    }
    wheels_.publish(geometry_msgs::Twist());
    ASSERT_TRUE(eventually([this] { return std::abs(height() - kHeight) < 0.005; }));
  }
  void putBack() {
    ASSERT_TRUE(call<std_srvs::Trigger>(name_space_ + "/fake_fetch/reset").success);
    ASSERT_TRUE(eventually([this] { return std::abs(height()) < 1e-6 && std::abs(x()) < 1e-6; }));
  }
  State replay(std::int64_t behavior) {
    actionlib::SimpleActionClient<ReplayAction> client(name_space_ + "/replay", false);
    EXPECT_TRUE(client.waitForServer(kPatience));
    ReplayGoal goal;
    goal.behavior = std::to_string(behavior);
    client.sendGoal(goal);
    EXPECT_TRUE(client.waitForResult(kPatience));
    return client.getState();
  }

 private:
  using Torso = actionlib::SimpleActionClient<FollowJointTrajectoryAction>;

  double locked(const double& value) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return value;
  }
  void onJoints(const sensor_msgs::JointState& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t i = 0; i < message.name.size(); ++i) {
      if (message.name[i] == "torso_lift_joint") height_ = message.position[i];
    }
  }

  const std::string name_space_;
  ros::NodeHandle node_;
  std::unique_ptr<test::NodeProcess> robot_, player_;
  mutable std::mutex mutex_;
  double height_ = -1, x_ = -1;
  ros::Subscriber joints_, pose_;
  ros::Publisher wheels_;
  std::unique_ptr<Torso> torso_;
};

struct World {
  World() {
    spinner.start();
    one = std::make_unique<Fetch>("/robot1", "robot1", store);
    two = std::make_unique<Fetch>("/robot2", "robot2_tf", store);
  }
  ~World() {
    one.reset();
    two.reset();
    spinner.stop();
    ros::shutdown();
  }

  test::TestGraph graph;
  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  ros::NodeHandle node;
  ros::AsyncSpinner spinner{2};
  std::unique_ptr<Fetch> one, two;
};

class SeveralRobots : public testing::Test {
 protected:
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() { delete world; }

  /// What the first one does, by the recorder in its namespace.
  std::int64_t record() {
    const test::NodeProcess recorder(
        {AFTERGLOW_TEST_RECORDER_NODE, "__ns:=/robot1", "_store:=" + store_});
    StartRecording::Request request;
    request.name = "reach";
    request.topics = {"/robot1" + kTorso + "/goal", "/robot1/cmd_vel"};
    const auto started = call<StartRecording>("/robot1/recorder_node/start_recording", request);
    EXPECT_TRUE(started.success) << started.message;
    one_->perform();
    StopRecording::Request stop;
    stop.outcome = "success";
    EXPECT_TRUE(call<StopRecording>("/robot1/recorder_node/stop_recording", stop).success);
    return started.behavior_id;
  }
  /// The command's standard output and error.
  static std::string afterglow(std::vector<std::string> words) {
    words.insert(words.begin(), AFTERGLOW_TEST_COMMAND);
    return runProgram(words).output;
  }
  std::string dryRun(std::int64_t behavior, const std::vector<std::string>& options) const {
    std::vector<std::string> words = {"play",       std::to_string(behavior), "--dry-run",
                                      "--store",    store_,                   "--robot",
                                      "fetch",      "--allow-motion"};
    words.insert(words.end(), options.begin(), options.end());
    return afterglow(words);
  }
  void expectRecordedNames(std::int64_t id) const {
    const auto store = replay::openStore(store_, replay::OpenMode::ReadOnly);
    const replay::Behavior behavior = store->behavior(id).value();
    EXPECT_EQ(replay::recordedRobot(behavior), replay::RobotNames({"/robot1", "robot1"}));
    EXPECT_NE(replay::recordedUrdf(behavior), "");
    EXPECT_NE(behavior.snapshot.find("robot1/odom->robot1/base_link"), std::string::npos)
        << behavior.snapshot;
    std::vector<std::string> context;
    for (const auto& topic : store->contextTopics(behavior)) context.push_back(topic.topic);
    EXPECT_EQ(std::count(context.begin(), context.end(), "/robot1/joint_states"), 1);
    EXPECT_EQ(std::count(context.begin(), context.end(), "/robot1/odom"), 1);
    EXPECT_EQ(std::count(context.begin(), context.end(), "/tf"), 1);
    EXPECT_EQ(std::count(context.begin(), context.end(), "/robot2/joint_states"), 0);
  }

  static inline World* world = nullptr;
  const std::string store_ = world->store;
  const std::unique_ptr<Fetch>&one_ = world->one, &two_ = world->two;
};

TEST_F(SeveralRobots, replayWhatOneOfThemWasRecordedDoingWhereItsPlayerIs) {
  const std::int64_t behavior = record();
  const double recorded_x = one_->x();
  EXPECT_GT(recorded_x, 0.2);
  expectRecordedNames(behavior);

  one_->putBack();
  two_->putBack();
  for (const auto& [robot, other] : {std::pair(&one_, &two_), std::pair(&two_, &one_)}) {
    const State state = (*robot)->replay(behavior);
    EXPECT_EQ(state, State::SUCCEEDED) << state.getText() << (*robot)->log();
    EXPECT_TRUE(eventually([&] { return std::abs((*robot)->height() - kHeight) < 0.005; }));
    EXPECT_NEAR((*robot)->x(), recorded_x, 0.03);
    EXPECT_NEAR((*other)->height(), 0, 1e-6) << "the other one stands";
    EXPECT_NEAR((*other)->x(), 0, 1e-6);
    (*robot)->putBack();
  }

  const std::string second = dryRun(behavior, {"__ns:=/robot2"});
  EXPECT_NE(second.find("/robot1/cmd_vel as /robot2/cmd_vel"), std::string::npos) << second;
  EXPECT_EQ(second.find("would be refused"), std::string::npos) << second;
  EXPECT_EQ(dryRun(behavior, {"--robot-namespace", "robot2"}), second);
  const std::string as_recorded = dryRun(behavior, {});
  EXPECT_EQ(as_recorded.find("cmd_vel as"), std::string::npos) << as_recorded;
  EXPECT_EQ(as_recorded.find("would be refused"), std::string::npos) << as_recorded;
  const std::string alone = dryRun(behavior, {"--robot-namespace", "/"});
  EXPECT_NE(alone.find("would be refused: there is no action server " + kTorso),
            std::string::npos)
      << alone;
}

TEST_F(SeveralRobots, areLookedAtEachByADoctorInItsNamespace) {
  for (const char* name_space : {"/robot1", "/robot2"}) {
    const std::string text = afterglow({"doctor", "--robot", "fetch", "--json", "--store",
                                        world->folder.path("s.db"),
                                        std::string("__ns:=") + name_space});
    const std::size_t end = text.rfind('}');
    const auto json = nlohmann::json::parse(text.substr(0, end + 1));
    std::map<std::string, std::string> levels;
    for (const auto& check : json["checks"]) levels[check["name"]] = check["level"];
    for (const char* of_robot : {"controllers", "joints", "description", "base", "odometry",
                                 "frames", "scan", "emergency stop"}) {
      EXPECT_EQ(levels[of_robot], "ok") << of_robot << " in " << name_space << ": " << text;
    }
  }
}

}  // namespace
}  // namespace afterglow::nodes::several_robots_ros_test
