// A replay in the time of a simulation, fast, slow and paused, on a fake Fetch that lives in it.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <control_msgs/FollowJointTrajectoryAction.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <rosgraph_msgs/Clock.h>
#include <std_srvs/Trigger.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/fetch_witness.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::replay_in_simulation_ros_test {
namespace {

using test::eventually;
using Torso = actionlib::SimpleActionClient<control_msgs::FollowJointTrajectoryAction>;

constexpr double kSpeed = 0.25;  // m/s

/// /clock, as Gazebo gives it: every few milliseconds, and not while it is paused.
class Simulation {
 public:
  Simulation() : publisher_(node_.advertise<rosgraph_msgs::Clock>("/clock", 10)) {
    thread_ = std::thread([this] { run(); });
  }
  ~Simulation() { end(); }
  void end() {
    is_over_ = true;
    if (thread_.joinable()) thread_.join();
    publisher_.shutdown();
  }
  /// Simulated seconds a second; 0: paused.
  void setSpeed(double speed) { speed_ = speed; }
  double now() const { return now_; }
  void wait(double seconds) const {
    for (const double end = now_ + seconds; now_ < end;) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

 private:
  void run() {
    constexpr std::chrono::milliseconds kTick(4);
    auto next = std::chrono::steady_clock::now();
    while (!is_over_) {
      if (speed_ > 0) {
        now_ = now_ + speed_ * std::chrono::duration<double>(kTick).count();
        rosgraph_msgs::Clock message;
        message.clock = ros::Time(now_);
        publisher_.publish(message);
      }
      std::this_thread::sleep_until(next += kTick);
    }
  }

  ros::NodeHandle node_;
  ros::Publisher publisher_;
  std::atomic<double> speed_{1}, now_{100};
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

/// Before any node begins: this one, too, has to date its goals as the robot does.
struct SimulatedTime {
  SimulatedTime() { ros::param::set("/use_sim_time", true); }
};

struct ReplayInSimulation : testing::Test {
  ReplayInSimulation() {
    node.setParam("/robot_description", test::fileBytes("assets/fetch.urdf"));
    simulation.emplace();
    robot = std::make_unique<test::NodeProcess>(Texts{AFTERGLOW_TEST_FAKE_FETCH_NODE});
    recorder = std::make_unique<test::NodeProcess>(
        Texts{AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + store});
    spinner.start();
    witness = std::make_unique<test::FetchWitness>();
    torso = std::make_unique<Torso>(test::kTorsoAction, false);
    wheels = node.advertise<geometry_msgs::Twist>("/cmd_vel", 10);
    EXPECT_TRUE(eventually([this] { return torso->isServerConnected(); }));
  }
  ~ReplayInSimulation() override {
    torso.reset();
    spinner.stop();
  }
  using Texts = std::vector<std::string>;

  template <typename Service>
  static typename Service::Response call(const std::string& name,
                                         const typename Service::Request& request = {}) {
    Service service;
    service.request = request;
    EXPECT_TRUE(ros::service::waitForService(name, ros::Duration(20))) << name;
    EXPECT_TRUE(ros::service::call(name, service)) << name;
    return service.response;
  }

  void lift(double height) const {
    control_msgs::FollowJointTrajectoryGoal goal;
    goal.trajectory.joint_names = {"torso_lift_joint"};
    goal.trajectory.points.resize(1);
    goal.trajectory.points[0].positions = {height};
    goal.trajectory.points[0].time_from_start = ros::Duration(1);
    torso->sendGoal(goal);
    ASSERT_TRUE(eventually([this] { return torso->getState().isDone(); }));
    ASSERT_EQ(torso->getState(), actionlib::SimpleClientGoalState::SUCCEEDED);
  }
  /// Lifts the torso, drives for a third of a meter, and lifts it again: four simulated seconds.
  void perform() {
    ASSERT_TRUE(eventually([this] { return wheels.getNumSubscribers() >= 3; }));
    lift(0.05);
    geometry_msgs::Twist forward;
    forward.linear.x = kSpeed;
    for (const double end = simulation->now() + 1.3; simulation->now() < end;) {
      wheels.publish(forward);
      simulation->wait(0.05);
    }
    wheels.publish(geometry_msgs::Twist());
    simulation->wait(0.5);
    lift(0.1);
  }
  std::string record() {
    StartRecording::Request request;
    request.name = "reach";
    request.topics = {test::kTorsoAction + "/goal", "/cmd_vel"};
    const auto started = call<StartRecording>("/recorder_node/start_recording", request);
    EXPECT_TRUE(started.success) << started.message;
    perform();
    StopRecording::Request stop;
    stop.outcome = "success";
    EXPECT_TRUE(call<StopRecording>("/recorder_node/stop_recording", stop).success);
    return std::to_string(started.behavior_id);
  }
  /// Stamps would all be one: neither without a /clock, nor with one that says 0.
  void expectNoRecordingWhileTimeStands() {
    StartRecording::Request request;
    request.name = "nothing";
    request.topics = {"/cmd_vel"};
    EXPECT_EQ(call<StartRecording>("/recorder_node/start_recording", request).message,
              "/use_sim_time is set and nobody publishes /clock: the robot's time stands still");
    const test::NodeProcess other({AFTERGLOW_TEST_RECORDER_NODE, "__name:=other",
                                   "_store:=" + folder.path("other.db"), "_connect_timeout:=1"});
    const ros::Publisher zero = node.advertise<rosgraph_msgs::Clock>("/clock", 1, true);
    zero.publish(rosgraph_msgs::Clock());
    EXPECT_EQ(call<StartRecording>("/other/start_recording", request).message,
              "/use_sim_time is set and the /clock of /test says 0: the robot's time has not begun");
  }
  std::unique_ptr<test::NodeProcess> play(const std::string& behavior) const {
    return std::make_unique<test::NodeProcess>(
        Texts{AFTERGLOW_TEST_COMMAND, "play", behavior, "--store", store, "--allow-motion",
              "--no-keys", "--longest-stall", "1", "--scan", "/base_scan", "--localization-noise",
              "position=0.005,yaw=0.005", "--report", report});
  }

  test::TestGraph graph;
  SimulatedTime time;
  test::TempFolder folder;
  std::string store = folder.path("behaviors.db"), report = folder.path("report.txt");
  ros::NodeHandle node;
  std::optional<Simulation> simulation;
  std::unique_ptr<test::NodeProcess> robot, recorder;
  std::unique_ptr<test::FetchWitness> witness;
  std::unique_ptr<Torso> torso;
  ros::Publisher wheels;
  ros::AsyncSpinner spinner{2};
};

TEST_F(ReplayInSimulation, movesTheBodyAsItWentFastSlowlyAndThroughAPause) {
  simulation->setSpeed(2);
  const std::string behavior = record();
  const double end_x = witness->truth().x;
  ASSERT_GT(end_x, 0.25);
  ASSERT_TRUE(call<std_srvs::Trigger>("/fake_fetch/reset").success);
  ASSERT_TRUE(eventually([this] { return std::abs(witness->truth().x) < 1e-6; }));
  wheels.shutdown();

  const auto playing = play(behavior);
  ASSERT_TRUE(eventually([&] { return witness->truth().x > 0.1; })) << playing->log();
  simulation->setSpeed(0.3);
  const double slow_x = witness->truth().x, slow_at = simulation->now();
  simulation->wait(0.4);
  EXPECT_NEAR(witness->truth().x - slow_x, kSpeed * (simulation->now() - slow_at), 0.06);
  simulation->setSpeed(0);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // what was on its way
  const double paused_x = witness->truth().x;
  std::this_thread::sleep_for(std::chrono::milliseconds(700));  // joint states are too old by then
  EXPECT_EQ(witness->truth().x, paused_x);
  simulation->setSpeed(2);
  EXPECT_EQ(playing->exitStatus(), 0) << playing->log();
  EXPECT_NEAR(witness->truth().x, end_x, 0.03);
  EXPECT_NEAR(witness->height(), 0.1, 0.005);
  const std::string said = test::fileBytes(report);
  EXPECT_NE(said.find("time was the /clock of /test, as /use_sim_time is set"), std::string::npos)
      << said;
  bool is_set = false;
  EXPECT_TRUE(node.getParam("/use_sim_time", is_set) && is_set) << "left alone";

  simulation->end();
  const auto refused = play(behavior);
  EXPECT_EQ(refused->exitStatus(), 1);
  EXPECT_NE(refused->log().find("/use_sim_time is set and nobody publishes /clock"),
            std::string::npos)
      << refused->log();
  expectNoRecordingWhileTimeStands();
}

}  // namespace
}  // namespace afterglow::nodes::replay_in_simulation_ros_test
