// The guard on the robot: this process is the robot, and a player that says what a test has it say;
// or a player in a process of its own.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/ReplayAction.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <thread>

#include "nodes/guard/guard_messages.hpp"
#include "nodes/guard/machine_name.hpp"
#include "replay/clock/steady_time.hpp"
#include "tests/support/guarded_robot.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_bytes.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::robot_guard_ros_test {
namespace {

using namespace test::guarded;
using test::eventually;
using Client = actionlib::SimpleActionClient<ReplayAction>;
using std::chrono::milliseconds;

constexpr int kPatienceMs = 150;
/// What is promised: the patience and 100 ms.
constexpr milliseconds kPromised(kPatienceMs + 100);

template <typename Ros>
GuardOutput outputOf(const std::string& topic, const Ros& stop) {
  namespace traits = ros::message_traits;
  return {topic, traits::DataType<Ros>::value(), traits::MD5Sum<Ros>::value(),
          traits::Definition<Ros>::value(), test::rosBytes(stop)};
}

/// Says that it lives, every 20 ms, and what it moves.
class SpokenPlayer {
 public:
  explicit SpokenPlayer(const std::string& machine = machineName()) {
    static std::uint64_t count = 0;
    outputs_.player = ++count;
    outputs_.name = "/spoken";
    outputs_.machine = machine;
    outputs_.version = 1;
    outputs_.outputs = {outputOf("/cmd_vel", geometry_msgs::Twist()),
                        outputOf(kArm + "/cancel", actionlib_msgs::GoalID()),
                        outputOf("/no_controller/cancel", actionlib_msgs::GoalID())};
    drive_ = node_.advertise<geometry_msgs::Twist>("/cmd_vel", 10);
    outputs_topic_ = node_.advertise<GuardOutputs>("/afterglow_guard/outputs", 10);
    beats_ = node_.advertise<GuardBeat>("/afterglow_guard/beats", 10);
    answers_ = node_.subscribe("/afterglow_guard/answers", 100, &SpokenPlayer::onAnswer, this);
    thread_ = std::thread([this] { beat(); });
  }
  ~SpokenPlayer() {
    is_over_ = true;
    thread_.join();
  }

  /// Until the guard can stop the robot.
  bool isGuarded() {
    return eventually([&] {
      outputs_topic_.publish(outputs_);
      const GuardAnswer now = answer();
      return now.version == 1 && now.heard_by == std::vector<std::uint32_t>{1, 1, 0};
    });
  }
  /// The robot drives.
  bool drive() {
    moves_ = true;
    return eventually([&] {
      drive_.publish(forward());
      return heard_moving_.load();
    });
  }
  GuardAnswer answer() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return answer_;
  }
  std::atomic<bool> is_silent{false}, loses_every_third{false};
  std::atomic<std::uint32_t> patience_ms{kPatienceMs};

 private:
  void beat() {
    for (std::uint32_t count = 1; !is_over_; ++count) {
      std::this_thread::sleep_for(milliseconds(20));
      if (is_silent || (loses_every_third && count % 3 == 0)) continue;
      GuardBeat beat;
      beat.player = outputs_.player;
      beat.count = count;
      beat.sent_ns = static_cast<std::uint64_t>(replay::sinceBoot().ns);
      beat.patience_ms = patience_ms;
      if (moves_) {
        if (first_moving_ == 0) first_moving_ = count;
        beat.moving = {0, 1, 2};
      }
      beats_.publish(beat);
    }
  }
  void onAnswer(const GuardAnswer& answer) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (answer.player != outputs_.player) return;
    answer_ = answer;
    if (first_moving_ != 0 && first_moving_ <= answer.count) heard_moving_ = true;
  }

  GuardOutputs outputs_;
  mutable std::mutex mutex_;
  GuardAnswer answer_;
  std::atomic<bool> is_over_{false}, moves_{false}, heard_moving_{false};
  std::atomic<std::uint32_t> first_moving_{0};
  ros::NodeHandle node_;
  ros::Publisher drive_, outputs_topic_, beats_;
  ros::Subscriber answers_;
  std::thread thread_;
};

struct GuardedWorld {
  GuardedWorld() {
    int argc = 0;
    ros::init(argc, nullptr, "test", ros::init_options::NoSigintHandler);
    node = std::make_unique<ros::NodeHandle>();
    robot = std::make_unique<Robot>();
    spinner = std::make_unique<ros::AsyncSpinner>(2);
    spinner->start();
    Memory memory(store);
    for (int i = 0; i < 1200; ++i) memory.add("/cmd_vel", i * 0.05, forward());
    memory.add(kArm + "/goal", 0.1, elbowGoal());
    behavior = memory.addBehavior(60);
  }

  test::RosMaster master;
  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  std::int64_t behavior = 0;
  std::unique_ptr<ros::NodeHandle> node;
  std::unique_ptr<Robot> robot;
  std::unique_ptr<ros::AsyncSpinner> spinner;
};

struct RobotGuard : testing::Test {
  static void SetUpTestSuite() { world = new GuardedWorld; }
  static void TearDownTestSuite() {
    world->spinner->stop();
    ros::shutdown();
    delete world;
  }

  void SetUp() override {
    world->robot->forget();
    guard = std::make_unique<test::NodeProcess>(
        std::vector<std::string>{AFTERGLOW_TEST_AFTERGLOW_GUARD});
    ASSERT_TRUE(eventually([&] { return isNode("/afterglow_guard", guard->pid()); }));
  }
  void TearDown() override {
    if (!player || killed) return;
    player->interrupt();
    player->exitStatus();
  }

  /// From then on; the promise is kept.
  void expectStopped(Moment since, milliseconds promised = kPromised) const {
    const Robot& robot = *world->robot;
    ASSERT_TRUE(eventually([&] { return robot.stopped() && robot.canceled(); })) << guard->log();
    const std::chrono::duration<double, std::milli> zero = *robot.stopped() - since,
                                                    cancel = *robot.canceled() - since;
    std::cout << "zero velocity after " << zero.count() << " ms, cancel after " << cancel.count()
              << " ms\n";
    EXPECT_LT(zero, promised) << guard->log();
    EXPECT_LT(cancel, promised) << guard->log();
  }

  /// A player in motion, by a name of its own: names of nodes that died are not taken over.
  void playOn() {
    static int count = 0;
    const std::string name = "/guarded_player_" + std::to_string(++count);
    player = std::make_unique<test::NodeProcess>(std::vector<std::string>{
        AFTERGLOW_TEST_PLAYER_NODE, "__name:=" + name.substr(1), "replay:=" + name + "/replay",
        "_store:=" + world->store, "_allow_motion:=true", "_hold:=0", "_open_loop:=true",
        "_no_scan:=true",
        "_longest_stall:=" + std::to_string(kPatienceMs * 1e-3)});
    client = std::make_unique<Client>(name + "/replay", false);
    ASSERT_TRUE(client->waitForServer(ros::Duration(30))) << player->log();
    ReplayGoal goal;
    goal.behavior = std::to_string(world->behavior);
    client->sendGoal(goal);
    ASSERT_TRUE(eventually([&] { return world->robot->isInMotion(); })) << player->log();
    player_guard = guardOf(player->pid());
    ASSERT_GT(player_guard, 0);
  }
  void signalBoth(int number) const {
    kill(player_guard, number);
    player->signal(number);
  }
  std::string resultText() {
    EXPECT_TRUE(client->waitForResult(ros::Duration(30))) << player->log();
    return client->getState().getText();
  }

  static inline GuardedWorld* world = nullptr;
  std::unique_ptr<test::NodeProcess> guard, player;
  std::unique_ptr<Client> client;
  pid_t player_guard = 0;
  bool killed = false;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// ---------------------------------------------------------------------------- what a player says

TEST_F(RobotGuard, stopsWhatMovesWhenItIsNotToldToGoOn) {
  SpokenPlayer spoken;
  ASSERT_TRUE(spoken.isGuarded());
  EXPECT_EQ(spoken.answer().is_beside, 1);
  ASSERT_TRUE(spoken.drive());
  spoken.loses_every_third = true;
  const Moment begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() < begin + milliseconds(500)) {
    EXPECT_FALSE(world->robot->stopped()) << "a beat is lost now and then";
    std::this_thread::sleep_for(milliseconds(10));
  }
  spoken.is_silent = true;
  expectStopped(std::chrono::steady_clock::now());
  EXPECT_TRUE(contains(guard->log(), "/spoken: the player was silent for more than 150 ms in "
                                     "motion (--longest-stall, ~longest_stall allows more): the "
                                     "robot is being stopped"));
  EXPECT_FALSE(contains(guard->log(), "nobody hears")) << "what nobody ever heard is not missed";
  spoken.is_silent = false;
  EXPECT_TRUE(eventually([&] { return !spoken.answer().stopped.empty(); }));
}

TEST_F(RobotGuard, waitsForNoPlayerThatIsSomewhereElseLongerThanASecond) {
  SpokenPlayer spoken("another machine");
  spoken.patience_ms = 5000;
  ASSERT_TRUE(spoken.isGuarded());
  EXPECT_EQ(spoken.answer().is_beside, 0);
  EXPECT_EQ(spoken.answer().patience_ms, 1000u);
}

TEST_F(RobotGuard, stopsTheRobotBeforeItEnds) {
  for (const bool is_signal : {true, false}) {
    SpokenPlayer spoken;
    ASSERT_TRUE(spoken.isGuarded());
    ASSERT_TRUE(spoken.drive());
    const Moment since = std::chrono::steady_clock::now();
    is_signal ? guard->signal(SIGTERM) : rosKill("/afterglow_guard");
    expectStopped(since, milliseconds(100));
    const std::string cause = is_signal ? "a signal" : "a shutdown request";
    EXPECT_TRUE(eventually([&] {
      return spoken.answer().stopped == "the guard on the robot was ended by " + cause;
    })) << spoken.answer().stopped;
    spoken.is_silent = true;  // while it says that it moves, it is stopped again and again
    EXPECT_EQ(guard->exitStatus(), 0) << guard->log();
    if (is_signal) SetUp();
  }
}

// ------------------------------------------------------------------------------- a real player

TEST_F(RobotGuard, letsAPlayerThatSleptNotDriveOn) {
  playOn();
  const Moment since = std::chrono::steady_clock::now();
  signalBoth(SIGSTOP);
  expectStopped(since);
  const Moment stopped = *world->robot->stopped();
  signalBoth(SIGCONT);
  EXPECT_FALSE(resultText().empty());
  EXPECT_EQ(world->robot->stopped(), stopped) << "not a single velocity came after it";
}

TEST_F(RobotGuard, isMissedByThePlayer) {
  playOn();
  guard->signal(SIGKILL);
  EXPECT_EQ(resultText(), "the guard on the robot is gone");
  const std::string report = client->getResult()->report;
  EXPECT_TRUE(contains(report, R"("on_robot":{"node":"/afterglow_guard","patience_ms":150.0)"))
      << report;
  EXPECT_TRUE(eventually([] { return world->robot->stopped() && world->robot->canceled(); }));
  EXPECT_FALSE(world->robot->drives());
}

TEST_F(RobotGuard, stopsTheRobotWhenPlayerAndWatchdogAreKilled) {
  playOn();
  killed = true;
  const Moment since = std::chrono::steady_clock::now();
  signalBoth(SIGKILL);
  expectStopped(since);
  EXPECT_FALSE(world->robot->drives());
}

// Last, as nobody finds anybody without it.
TEST_F(RobotGuard, isNoReasonToMoveWithoutAMaster) {
  playOn();
  world->master.end();
  expectStopped(std::chrono::steady_clock::now(), milliseconds(1000));
  EXPECT_TRUE(contains(resultText(), "the ROS master is gone")) << player->log();
}

}  // namespace
}  // namespace afterglow::nodes::robot_guard_ros_test
