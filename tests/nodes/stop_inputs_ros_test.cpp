// How people stop a replay: the emergency stop as a field of any message, a button that has to be
// held, and driving the robot themselves. A player and the fake Fetch, whose base is behind a
// multiplexer, in processes of their own; this process is the person.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/ReplayAction.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <signal.h>
#include <std_msgs/Bool.h>
#include <topic_tools/MuxSelect.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/player/stop_inputs.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/joystick.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_bytes.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::stop_inputs_ros_test {
namespace {

using test::eventually;
using Clock = std::chrono::steady_clock;
using Moment = Clock::time_point;
using Client = actionlib::SimpleActionClient<ReplayAction>;
using Milliseconds = std::chrono::duration<double, std::milli>;

/// What it takes is under 100 ms; a machine may have other things to do.
constexpr Milliseconds kInTime(250);

/// Ahead for a minute at 0.2 m/s, as it might have been recorded.
std::int64_t recordDrive(const std::string& path) {
  using geometry_msgs::Twist;
  constexpr std::int64_t kBegin = 1'600'000'000'000'000'000, kPeriod = 50'000'000;
  const auto store = replay::openStore(path, replay::OpenMode::ReadWrite);
  replay::Behavior behavior;
  behavior.recording = store->addRecording({0, "", "test", ""});
  const std::int64_t channel =
      store->addChannel(behavior.recording, test::rosChannel<Twist>("/cmd_vel"));
  Twist twist;
  twist.linear.x = 0.2;
  const replay::Bytes bytes = test::rosBytes(twist);
  std::uint64_t sequence = 0;
  for (; sequence < 1200; ++sequence) {
    const replay::Stamp at{kBegin + static_cast<std::int64_t>(sequence) * kPeriod};
    store->append({{channel, at, sequence, {}, bytes}});
  }
  behavior.name = "drive";
  behavior.begin = {kBegin};
  behavior.end = replay::Stamp{kBegin + static_cast<std::int64_t>(sequence) * kPeriod};
  behavior.topics = {"/cmd_vel"};
  return store->addBehavior(behavior);
}

/// What the base is told, and does.
class Base {
 public:
  explicit Base(ros::NodeHandle& node) {
    velocities_ = node.subscribe("/cmd_vel", 100, &Base::onVelocity, this);
    odometry_ = node.subscribe("/odom", 100, &Base::onOdometry, this);
  }
  bool isTold() const { return is_told_; }
  double speed() const { return speed_; }
  /// When the first zero velocity came after the last other one.
  std::optional<Moment> stopped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return stopped_;
  }

 private:
  void onVelocity(const geometry_msgs::Twist& twist) {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_told_ = twist.linear.x != 0;
    if (is_told_) stopped_ = std::nullopt;
    if (!is_told_ && !stopped_) stopped_ = Clock::now();
  }
  void onOdometry(const nav_msgs::Odometry& odometry) { speed_ = odometry.twist.twist.linear.x; }

  mutable std::mutex mutex_;
  std::optional<Moment> stopped_;
  std::atomic<bool> is_told_{false};
  std::atomic<double> speed_{0};
  ros::Subscriber velocities_, odometry_;
};

struct World {
  World() {
    node->setParam("/robot_description", test::fileBytes("assets/fetch.urdf"));
    robot = std::make_unique<test::NodeProcess>(
        std::vector<std::string>{AFTERGLOW_TEST_FAKE_FETCH_NODE});
    drive = recordDrive(store);
    player = std::make_unique<test::NodeProcess>(std::vector<std::string>{
        AFTERGLOW_TEST_PLAYER_NODE, "_store:=" + store, "_allow_motion:=true", "_open_loop:=true",
        "_no_scan:=true", "_longest_stall:=1", "_estop_topic:=/estop",
        "_hold_to_run:=/joy:10"});
    button = node->advertise<std_msgs::Bool>("/estop", 1, true);
    button.publish(std_msgs::Bool());
    runstop = node->advertise<std_msgs::Bool>("/enable_software_runstop", 1);
    teleop = node->advertise<geometry_msgs::Twist>("/teleop/cmd_vel", 1);
    spinner.start();
    client = std::make_unique<Client>("/replay", false);
    EXPECT_TRUE(client->waitForServer(ros::Duration(30))) << player->log();
    EXPECT_TRUE(eventually([this] { return runstop.getNumSubscribers() > 0; }));
  }
  ~World() {
    client.reset();
    spinner.stop();
    ros::shutdown();
  }
  void pressRunstop(bool is_pressed) {
    std_msgs::Bool word;
    word.data = is_pressed;
    runstop.publish(word);
  }

  test::TestGraph graph;
  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  std::int64_t drive = 0;
  std::unique_ptr<ros::NodeHandle> node = std::make_unique<ros::NodeHandle>();
  std::unique_ptr<test::NodeProcess> robot, player;
  std::unique_ptr<Client> client;
  ros::Publisher button, runstop, teleop;
  test::Joystick joystick{*node, "/joy", 10};
  Base base{*node};
  ros::AsyncSpinner spinner{2};
};

struct StopInputs : testing::Test {
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() { delete world; }

  /// Returns when the player waits for the button.
  void play() const {
    const int asked = timesAsked();
    ReplayGoal goal;
    goal.behavior = std::to_string(world->drive);
    world->client->sendGoal(goal);
    EXPECT_TRUE(eventually([&] { return timesAsked() > asked; })) << log();
  }
  int timesAsked() const {
    const std::string words = "hold button 10 of /joy to let the robot move", text = log();
    int count = 0;
    for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1))
      ++count;
    return count;
  }
  std::string log() const { return world->player->log(); }
  /// The replay goes on for so long.
  bool goesOn(double seconds) const {
    return !world->client->waitForResult(ros::Duration(seconds));
  }
  std::string resultText() const {
    EXPECT_TRUE(world->client->waitForResult(ros::Duration(30))) << log();
    return world->client->getState().getText();
  }
  void press() const {
    world->joystick.press(false);
    world->joystick.press(true);
  }
  bool drives() const {
    return eventually([] { return world->base.speed() > 0.15; });
  }
  bool stands() const {
    return eventually([] { return std::abs(world->base.speed()) < 1e-6; });
  }
  void expectStopped(Moment since, Milliseconds most, const char* what) const {
    ASSERT_TRUE(eventually([] { return world->base.stopped().has_value(); })) << log();
    const Milliseconds zero = *world->base.stopped() - since;
    std::cout << what << ": zero velocity after " << zero.count() << " ms\n";
    EXPECT_LT(zero, most) << what;
  }

  static inline World* world = nullptr;
};

/// An emergency stop, and what it said.
struct Watched {
  explicit Watched(const std::string& text, double longest_silence_s = 0)
      : stop(options(text, longest_silence_s), [this](const std::string& why) {
          const std::lock_guard<std::mutex> lock(mutex);
          reason = why;
        }) {}
  static EmergencyStopOptions options(const std::string& text, double longest_silence_s) {
    EmergencyStopOptions options;
    options.set(text);
    options.longest_silence_s = longest_silence_s;
    return options;
  }
  std::string refusal() {
    try {
      stop.check();
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }
  /// Milliseconds until it stops the robot.
  double wait(Moment since) {
    eventually([this] { return !said().empty(); });
    return Milliseconds(Clock::now() - since).count();
  }
  std::string said() {
    const std::lock_guard<std::mutex> lock(mutex);
    return reason;
  }

  std::mutex mutex;
  std::string reason;
  EmergencyStop stop;
};

TEST_F(StopInputs, areABooleanOfAnyMessageThatSomebodyPublishes) {
  Watched runstopped("/robot_state:runstopped"), ready("/robot_state:!ready");
  EXPECT_EQ(runstopped.refusal(), "");
  EXPECT_EQ(ready.refusal(), "");
  EXPECT_EQ(Watched("/robot_state").refusal(),
            "motion is refused: the emergency stop cannot be read (/robot_state): "
            "afterglow/SimulatedRobotState has several boolean fields, one of which is to be "
            "named: ready, faulted, runstopped");
  EXPECT_EQ(Watched("/nobody:x").refusal(),
            "motion is refused: nobody publishes the emergency stop /nobody:x");
  const Moment since = Clock::now();
  world->pressRunstop(true);
  EXPECT_LT(runstopped.wait(since), kInTime.count());
  EXPECT_EQ(runstopped.said(), "the emergency stop was pressed (/robot_state:runstopped)");
  EXPECT_TRUE(eventually([&] { return !ready.said().empty(); })) << "it is false then";
  EXPECT_EQ(Watched("/software_runstop_enabled").refusal(),
            "motion is refused: the emergency stop is pressed (/software_runstop_enabled)");
  world->pressRunstop(false);
}

// -------------------------------------------------------------------------------- hold to run

TEST_F(StopInputs, areAButtonThatHasToBeHeld) {
  world->joystick.press(true);
  play();
  EXPECT_TRUE(goesOn(0.6));
  EXPECT_FALSE(world->base.isTold()) << "it was held before";
  press();
  ASSERT_TRUE(drives()) << log();

  Moment since = Clock::now();
  world->joystick.press(false);
  expectStopped(since, kInTime, "button released");
  EXPECT_TRUE(stands());
  EXPECT_FALSE(world->base.isTold());
  press();
  ASSERT_TRUE(drives()) << "pressed again: " << log();

  since = Clock::now();
  world->joystick.beSilent(true);
  expectStopped(since, Milliseconds(300) + kInTime, "joystick silent");
  world->joystick.beSilent(false);
  EXPECT_TRUE(goesOn(0.3));
  EXPECT_FALSE(world->base.isTold()) << "it does not drive on by itself";
  world->client->cancelGoal();
  resultText();
}

TEST_F(StopInputs, areNoButtonThatTheirOwnNodePublishes) {
  HoldButtonOptions options;
  options.set("/joy:10");
  options.patience_s = 0.8;
  HoldButton button(options, [](bool) {});  // of this node, as the joystick is
  press();
  try {
    button.waitUntilHeld([] { return false; });
    FAIL() << "what a replay publishes holds its own button";
  } catch (const std::runtime_error& refusal) {
    EXPECT_EQ(std::string(refusal.what()),
              "motion is refused: nobody sends /joy (button 10 of /joy)");
  }
}

// ---------------------------------------------------------------------------------- taking over

TEST_F(StopInputs, arePeopleWhoDriveTheRobotThemselves) {
  topic_tools::MuxSelect select;
  const auto pass = [&](const std::string& topic) {
    select.request.topic = topic;
    ASSERT_TRUE(ros::service::call("/cmd_vel_mux/select", select));
  };
  play();
  press();
  ASSERT_TRUE(drives()) << log();
  pass("/teleop/cmd_vel");
  geometry_msgs::Twist back;
  back.linear.x = -0.15;
  EXPECT_TRUE(eventually([&] {
    world->teleop.publish(back);
    return world->base.speed() < -0.1;
  }));
  pass("/cmd_vel");
  EXPECT_EQ(resultText(), "somebody else drives the base on /teleop/cmd_vel");
  EXPECT_TRUE(stands()) << "though the button is held";
  ros::WallDuration(0.3).sleep();  // the player has ended; were it to drive on, it had by now
  EXPECT_LT(std::abs(world->base.speed()), 1e-6);

  pass("/teleop/cmd_vel");
  ReplayGoal again;
  again.behavior = std::to_string(world->drive);
  world->client->sendGoal(again);
  EXPECT_EQ(resultText(),
            "motion is refused: somebody else drives the base on /teleop/cmd_vel");
  pass("/cmd_vel");
}

// ---------------------------------------------------------------------------- the emergency stop

TEST_F(StopInputs, areLatchedAndSilentUntilTheirPublisherIsGone) {
  play();
  press();
  ASSERT_TRUE(drives()) << log();
  EXPECT_TRUE(goesOn(0.7)) << "a silence that means nothing";
  const Moment since = Clock::now();
  world->button.shutdown();
  expectStopped(since, Milliseconds(1000), "the emergency stop's publisher gone");
  EXPECT_EQ(resultText(), "the publisher of the emergency stop is gone (/estop)");
}

// Last, as the robot is gone then.
TEST_F(StopInputs, areEmergencyStopsThatFallSilentOrDie) {
  Watched periodic("/robot_state:runstopped"), patient("/robot_state:runstopped", 50);
  ASSERT_EQ(periodic.refusal(), "");
  ASSERT_EQ(patient.refusal(), "");
  Moment since = Clock::now();
  world->robot->signal(SIGSTOP);
  const double silent = periodic.wait(since);
  EXPECT_EQ(periodic.said(), "the emergency stop is silent (/robot_state:runstopped)");
  EXPECT_GT(silent, 350) << "five periods of 100 ms, one of which was under way";
  EXPECT_LT(silent, 500 + kInTime.count());
  world->robot->signal(SIGKILL);
  const double dead = patient.wait(since);
  EXPECT_EQ(patient.said().rfind("the publisher of the emergency stop is gone", 0), 0u)
      << patient.said();
  EXPECT_LT(dead, 500 + 1500 + kInTime.count());
  std::cout << "silent after " << silent << " ms, dead after " << dead << " ms\n";
}

}  // namespace
}  // namespace afterglow::nodes::stop_inputs_ros_test
