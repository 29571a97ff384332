// The watchdog beside a player, the emergency stop and the checks before motion: a player in a
// process of its own, and this process as the robot.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/ReplayAction.h>
#include <control_msgs/FollowJointTrajectoryActionGoal.h>
#include <gtest/gtest.h>
#include <sensor_msgs/JointState.h>
#include <signal.h>
#include <std_msgs/Bool.h>

#include <chrono>
#include <functional>
#include <iostream>
#include <memory>
#include <thread>

#include "tests/support/guarded_robot.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::replay_guard_ros_test {
namespace {

using test::eventually;
using Client = actionlib::SimpleActionClient<ReplayAction>;
using State = actionlib::SimpleClientGoalState;
using namespace test::guarded;

/// What it takes is 100 ms; a machine may have other things to do.
constexpr std::chrono::milliseconds kInTime(250);

struct World {
  World() {
    int argc = 0;
    ros::init(argc, nullptr, "test", ros::init_options::NoSigintHandler);
    node = std::make_unique<ros::NodeHandle>();
    robot = std::make_unique<Robot>();
    spinner = std::make_unique<ros::AsyncSpinner>(2);
    spinner->start();
    Memory memory(store);
    for (int i = 0; i < 1200; ++i) memory.add("/cmd_vel", i * 0.05, forward());
    memory.add(kArm + "/goal", 0.1, elbowGoal());
    long_behavior = memory.addBehavior(60);
    for (int i = 0; i < 10; ++i) memory.add("/cmd_vel", i * 0.05, forward());
    short_behavior = memory.addBehavior(1);
    sensor_msgs::JointState state;
    state.name = {"elbow"};
    state.position = {0.52};
    memory.add("/joint_states", 0.01, state);
    memory.add(kArm + "/goal", 0.1, elbowGoal());
    from_elsewhere = memory.addBehavior(1);
    state.position = {0.25};
    memory.add("/joint_states", 0.01, state);
    memory.add(kArm + "/goal", 0.1, elbowGoal());
    from_nearby = memory.addBehavior(1);
    auto other = elbowGoal();
    other.goal.trajectory.joint_names = {"elbow", "tail"};
    memory.add(kArm + "/goal", 0.1, other);
    memory.add("/wing/goal", 0.1, other);
    memory.add("/other_cmd_vel", 0.1, forward());
    of_another_robot = memory.addBehavior(1);
    memory.add(kArm + "/goal", 0.1, other);
    of_another_arm = memory.addBehavior(1);
  }

  test::RosMaster master;
  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  std::int64_t long_behavior = 0, short_behavior = 0, from_elsewhere = 0, from_nearby = 0;
  std::int64_t of_another_robot = 0, of_another_arm = 0;
  std::unique_ptr<ros::NodeHandle> node;
  std::unique_ptr<Robot> robot;
  std::unique_ptr<ros::AsyncSpinner> spinner;
};

struct ReplayGuard : testing::Test {
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() {
    world->spinner->stop();
    ros::shutdown();
    delete world;
  }

  void TearDown() override { endPlayer(); }

  void endPlayer() {
    if (!player) return;
    if (!killed) player->interrupt();
    player->exitStatus();
    player.reset();
    killed = false;
  }

  /// A player of its own for every test: names of nodes that died are not taken over.
  void play(std::int64_t behavior, const std::vector<std::string>& parameters = {}) {
    endPlayer();
    world->robot->forget();
    static int count = 0;
    name = "/player_" + std::to_string(++count);
    std::vector<std::string> arguments = {
        AFTERGLOW_TEST_PLAYER_NODE, "__name:=" + name.substr(1), "replay:=" + name + "/replay",
        "_store:=" + world->store,  "_allow_motion:=true",       "_open_loop:=true",
        "_hold:=0",                 "_no_scan:=true"};
    arguments.insert(arguments.end(), parameters.begin(), parameters.end());
    player = std::make_unique<test::NodeProcess>(arguments);
    client = std::make_unique<Client>(name + "/replay", false);
    ASSERT_TRUE(client->waitForServer(ros::Duration(30))) << player->log();
    goOnWith(behavior);
  }
  /// By the same player.
  void goOnWith(std::int64_t behavior) const {
    ReplayGoal goal;
    goal.behavior = std::to_string(behavior);
    client->sendGoal(goal);
  }
  std::string resultText() {
    EXPECT_TRUE(client->waitForResult(ros::Duration(30))) << player->log();
    return client->getState().getText();
  }
  /// Milliseconds from then until the robot was told to stop, by velocity and by cancel.
  void expectStopped(Moment since) const {
    const Robot& robot = *world->robot;
    ASSERT_TRUE(eventually([&] { return robot.stopped() && robot.canceled(); })) << player->log();
    const std::chrono::duration<double, std::milli> zero = *robot.stopped() - since,
                                                    cancel = *robot.canceled() - since;
    std::cout << "zero velocity after " << zero.count() << " ms, cancel after " << cancel.count()
              << " ms\n";
    EXPECT_LT(zero, kInTime);
    EXPECT_LT(cancel, kInTime);
  }

  /// A player whose robot moves, and only a message or its end stops it.
  void playOn() {
    play(world->long_behavior, {"_longest_stall:=10"});
    ASSERT_TRUE(eventually([&] { return world->robot->isInMotion(); })) << player->log();
  }
  /// The player cannot help: whatever is sent comes from the watchdog.
  void expectStoppedByTheGuardAlone(const std::string& reason,
                                    const std::function<void(pid_t guard)>& end) {
    playOn();
    const pid_t guard = guardOf(player->pid());
    ASSERT_GT(guard, 0);
    player->signal(SIGSTOP);
    const Moment since = std::chrono::steady_clock::now();
    end(guard);
    expectStopped(since);
    player->signal(SIGCONT);
    EXPECT_EQ(resultText(), "the watchdog stopped the robot: " + reason);
    EXPECT_FALSE(world->robot->drives());
    EXPECT_NE(player->log().find("afterglow_replay_guard: " + reason +
                                 ": the robot is being stopped"),
              std::string::npos)
        << player->log();
  }
  void expectStoppedAfter(const std::function<void()>& end) {
    playOn();
    const Moment since = std::chrono::steady_clock::now();
    end();
    expectStopped(since);
  }

  static inline World* world = nullptr;
  std::string name;
  bool killed = false;
  std::unique_ptr<test::NodeProcess> player;
  std::unique_ptr<Client> client;
};

TEST_F(ReplayGuard, stopsTheRobotWhenThePlayerHangsAndLetsItNotDriveOn) {
  play(world->long_behavior);
  ASSERT_TRUE(eventually([&] { return world->robot->isInMotion(); })) << player->log();
  const Moment stopped = std::chrono::steady_clock::now();
  player->signal(SIGSTOP);
  expectStopped(stopped);
  player->signal(SIGCONT);
  const std::string cause = "the watchdog stopped the robot: the player was silent for more than";
  EXPECT_EQ(resultText().substr(0, cause.size()), cause);
  EXPECT_FALSE(world->robot->drives());
}

TEST_F(ReplayGuard, endsWithTheReplay) {
  play(world->long_behavior, {"_longest_stall:=10"});
  ASSERT_TRUE(eventually([&] { return world->robot->isInMotion(); })) << player->log();
  client->cancelGoal();
  resultText();
  EXPECT_EQ(client->getState(), State::PREEMPTED);
  EXPECT_EQ(guardOf(player->pid()), 0);
  EXPECT_FALSE(isRegistered(name + "_guard"));
}

TEST_F(ReplayGuard, isAnotherOneForEachReplayAndNoneBetweenThem) {
  play(world->short_behavior);
  pid_t first = 0;
  ASSERT_TRUE(eventually([&] { return (first = guardOf(player->pid())) > 0; })) << player->log();
  resultText();
  EXPECT_EQ(client->getState(), State::SUCCEEDED) << player->log();
  EXPECT_TRUE(eventually([&] { return world->robot->stopped().has_value(); }));
  EXPECT_EQ(guardOf(player->pid()), 0) << "nothing is in motion between two of them";
  EXPECT_EQ(player->log().find("the robot is being stopped"), std::string::npos);

  world->robot->forget();
  goOnWith(world->long_behavior);
  ASSERT_TRUE(eventually([&] { return world->robot->isInMotion(); })) << player->log();
  EXPECT_NE(guardOf(player->pid()), first);
  const Moment since = std::chrono::steady_clock::now();
  player->signal(SIGSTOP);
  expectStopped(since);
  player->signal(SIGCONT);
  EXPECT_EQ(resultText().rfind("the watchdog stopped the robot", 0), 0u);
}

// -------------------------------------------------------------------------------- the report

TEST_F(ReplayGuard, reportsAReplayThatWasStoppedOnItsWayToTheStart) {
  play(world->from_nearby, {"_to_start:=true", "_longest_stall:=10"});
  ASSERT_TRUE(eventually([&] { return world->robot->reaches(); })) << player->log();
  client->cancelGoal();
  EXPECT_EQ(resultText(), "canceled");
  const std::string report = client->getResult()->report;
  EXPECT_NE(report.find(R"("completed":false,"reason":"canceled")"), std::string::npos) << report;
  EXPECT_NE(report.find("the robot was moved to the start by"), std::string::npos) << report;
}

TEST_F(ReplayGuard, reportsAReplayThatLostItsWatchdogOnItsWayToTheStart) {
  play(world->from_nearby, {"_to_start:=true", "_longest_stall:=10"});
  ASSERT_TRUE(eventually([&] { return world->robot->reaches(); })) << player->log();
  kill(guardOf(player->pid()), SIGKILL);
  EXPECT_EQ(resultText(), "the watchdog is gone");
  const std::string report = client->getResult()->report;
  EXPECT_NE(report.find(R"("completed":false,"reason":"the watchdog is gone")"),
            std::string::npos)
      << report;
  EXPECT_TRUE(eventually([&] { return world->robot->canceled().has_value(); }));
}

// ---------------------------------------------------------------------------- the emergency stop

std_msgs::Bool word(bool is_pressed) {
  std_msgs::Bool message;
  message.data = is_pressed;
  return message;
}

TEST_F(ReplayGuard, letsTheEmergencyStopStopTheRobotAndKeepItFromMoving) {
  ros::Publisher button = world->node->advertise<std_msgs::Bool>("/estop", 1, true);
  button.publish(word(false));
  play(world->long_behavior, {"_longest_stall:=10", "_estop_topic:=/estop"});
  ASSERT_TRUE(eventually([&] { return world->robot->isInMotion(); })) << player->log();
  button.publish(word(true));
  EXPECT_EQ(resultText(), "the emergency stop was pressed (/estop)");
  EXPECT_TRUE(eventually([&] { return world->robot->stopped() && world->robot->canceled(); }));
  EXPECT_FALSE(world->robot->drives());
  ReplayGoal again;
  again.behavior = std::to_string(world->long_behavior);
  client->sendGoal(again);
  EXPECT_EQ(resultText(), "motion is refused: the emergency stop is pressed (/estop)");
  EXPECT_FALSE(world->robot->drives());
}

TEST_F(ReplayGuard, letsTheEmergencyStopStopTheRobotOnItsWayToTheStart) {
  ros::Publisher button = world->node->advertise<std_msgs::Bool>("/start_estop", 1, true);
  button.publish(word(false));
  play(world->from_nearby,
       {"_to_start:=true", "_longest_stall:=10", "_estop_topic:=/start_estop"});
  ASSERT_TRUE(eventually([&] { return world->robot->reaches(); })) << player->log();
  const Moment since = std::chrono::steady_clock::now();
  button.publish(word(true));
  ASSERT_TRUE(eventually([&] { return world->robot->canceled().has_value(); })) << player->log();
  EXPECT_LT(*world->robot->canceled() - since, kInTime);
  EXPECT_EQ(resultText(), "the emergency stop was pressed (/start_estop)");
  const std::string report = client->getResult()->report;
  EXPECT_NE(report.find("the robot was moved to the start by"), std::string::npos) << report;
}

TEST_F(ReplayGuard, demandsAnEmergencyStopThatIsAlive) {
  {
    ros::Publisher button = world->node->advertise<std_msgs::Bool>("/live_estop", 1, true);
    button.publish(word(false));
    play(world->long_behavior,
         {"_longest_stall:=10", "_estop_topic:=/live_estop", "_estop_longest_silence:=0.5"});
    EXPECT_EQ(resultText(), "the emergency stop is silent (/live_estop)");
  }
  ReplayGoal again;
  again.behavior = std::to_string(world->long_behavior);
  client->sendGoal(again);
  EXPECT_EQ(resultText(), "motion is refused: nobody publishes the emergency stop /live_estop");
}

// ------------------------------------------------------------------------------------- the checks

TEST_F(ReplayGuard, refusesToStartFromElsewhere) {
  play(world->from_elsewhere);
  EXPECT_EQ(resultText(),
            "motion is refused: the robot does not stand as it did: elbow is 0.42 rad off (now "
            "0.10, then 0.52); --to-start takes it there");
  EXPECT_FALSE(world->robot->isInMotion());
}

TEST_F(ReplayGuard, refusesControllersAndJointsThatAreNotThere) {
  play(world->of_another_robot, {"_wait_for_subscribers:=0.1"});
  EXPECT_EQ(resultText(),
            "motion is refused: nobody listens on /other_cmd_vel; there is no action server /wing");
  ReplayGoal other;
  other.behavior = std::to_string(world->of_another_arm);
  client->sendGoal(other);
  EXPECT_EQ(resultText(), "motion is refused: this robot has no joint tail (/joint_states)");
}

// ------------------------------------------------------- who is told to end, ends after the robot

TEST_F(ReplayGuard, stopsTheRobotBeforeItObeysAShutdown) {
  expectStoppedByTheGuardAlone("the watchdog was ended by a shutdown request", [this](pid_t) {
    rosKill(name + "_guard");
  });
  EXPECT_TRUE(eventually([&] { return !isRegistered(name + "_guard"); })) << "it ends then";
}

TEST_F(ReplayGuard, stopsTheRobotBeforeItObeysASignal) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    SCOPED_TRACE(signal);
    expectStoppedByTheGuardAlone("the watchdog was ended by a signal",
                                 [signal](pid_t guard) { kill(guard, signal); });
  }
}

TEST_F(ReplayGuard, hasThePlayerStopTheRobotBeforeItObeysAShutdownOrASignal) {
  const std::vector<std::function<void()>> ends = {[this] { rosKill(name); },
                                                   [this] { player->signal(SIGTERM); },
                                                   [this] { player->signal(SIGHUP); }};
  for (const auto& end : ends) {
    expectStoppedAfter(end);
    killed = true;
    EXPECT_EQ(player->exitStatus(), 0) << player->log();
    EXPECT_FALSE(isRegistered(name + "_guard"));
    player.reset();
  }
}

TEST_F(ReplayGuard, stopsTheRobotWhenBothAreToldToShutDownOrGetASignal) {
  const auto both_killed = [this](const std::string& first, const std::string& second) {
    std::thread one([&] { rosKill(name + first); });
    rosKill(name + second);
    one.join();
  };
  const std::vector<std::function<void()>> ends = {
      [&] { both_killed("", "_guard"); }, [&] { both_killed("_guard", ""); },
      [this] {
        const pid_t guard = guardOf(player->pid());
        kill(guard, SIGTERM);
        player->signal(SIGTERM);
      }};
  for (const auto& end : ends) {
    expectStoppedAfter(end);
    killed = true;
    EXPECT_EQ(player->exitStatus(), 0) << player->log();
    player.reset();
    EXPECT_FALSE(world->robot->drives());
  }
}

// Last: the master does not forget a node that was killed, and others wait for it.
TEST_F(ReplayGuard, isNeededForMotion) {
  play(world->long_behavior, {"_longest_stall:=10"});
  ASSERT_TRUE(eventually([&] { return world->robot->isInMotion(); })) << player->log();
  const pid_t guard = guardOf(player->pid());
  ASSERT_GT(guard, 0);
  kill(guard, SIGKILL);
  EXPECT_EQ(resultText(), "the watchdog is gone");
  EXPECT_TRUE(eventually([&] { return world->robot->stopped().has_value(); }));
  EXPECT_TRUE(world->robot->canceled());
}

TEST_F(ReplayGuard, stopsTheRobotWhenThePlayerIsKilledAndItIsToldToEndItself) {
  expectStoppedAfter([this] {
    const pid_t guard = guardOf(player->pid());
    player->signal(SIGKILL);
    killed = true;
    kill(guard, SIGTERM);
  });
  EXPECT_TRUE(eventually([&] { return !isRegistered(name + "_guard"); })) << "it ends then";
  EXPECT_FALSE(world->robot->drives());
}

TEST_F(ReplayGuard, stopsTheRobotWhenThePlayerIsKilled) {
  play(world->long_behavior, {"_longest_stall:=10"});
  ASSERT_TRUE(eventually([&] { return world->robot->isInMotion(); })) << player->log();
  EXPECT_TRUE(isRegistered(name + "_guard"));
  const Moment since = std::chrono::steady_clock::now();
  player->signal(SIGKILL);
  killed = true;
  expectStopped(since);
  EXPECT_TRUE(eventually([&] { return !isRegistered(name + "_guard"); })) << "it ends then";
  EXPECT_FALSE(world->robot->drives());
}

}  // namespace
}  // namespace afterglow::nodes::replay_guard_ros_test
