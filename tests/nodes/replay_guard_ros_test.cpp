// The watchdog beside a player, the emergency stop and the checks before motion: a player in a
// process of its own, and this process as the robot.
#include <actionlib/client/simple_action_client.h>
#include <actionlib_msgs/GoalID.h>
#include <actionlib_msgs/GoalStatusArray.h>
#include <afterglow/ReplayAction.h>
#include <control_msgs/FollowJointTrajectoryActionGoal.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <sensor_msgs/JointState.h>
#include <ros/network.h>
#include <signal.h>
#include <std_msgs/Bool.h>
#include <xmlrpcpp/XmlRpc.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::replay_guard_ros_test {
namespace {

using test::eventually;
using Client = actionlib::SimpleActionClient<ReplayAction>;
using State = actionlib::SimpleClientGoalState;
using Moment = std::chrono::steady_clock::time_point;

constexpr std::int64_t kMs = 1'000'000, kBegin = 1'600'000'000'000'000'000;
const std::string kArm = "/arm/follow_joint_trajectory";
/// What it takes is 100 ms; a machine may have other things to do.
constexpr std::chrono::milliseconds kInTime(250);

template <typename Ros>
replay::Bytes bytesOf(const Ros& message) {
  replay::Bytes bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

geometry_msgs::Twist forward() {
  geometry_msgs::Twist twist;
  twist.linear.x = 0.2;
  return twist;
}

control_msgs::FollowJointTrajectoryActionGoal elbowGoal() {
  control_msgs::FollowJointTrajectoryActionGoal goal;
  goal.goal.trajectory.joint_names = {"elbow"};
  goal.goal.trajectory.points.resize(1);
  goal.goal.trajectory.points[0].positions = {1.0};
  goal.goal.trajectory.points[0].time_from_start = ros::Duration(60);
  return goal;
}

/// Behaviors as they might have been recorded.
class Memory {
 public:
  explicit Memory(const std::string& path)
      : store_(replay::openStore(path, replay::OpenMode::ReadWrite)),
        recording_(store_->addRecording({0, "", "test", ""})) {}

  template <typename Ros>
  void add(const std::string& topic, double at_s, const Ros& message) {
    namespace traits = ros::message_traits;
    const std::int64_t channel = store_->addChannel(
        recording_, {topic, traits::DataType<Ros>::value(), traits::MD5Sum<Ros>::value(),
                     traits::Definition<Ros>::value(), false, "/recorded"});
    const auto ns = static_cast<std::int64_t>(at_s * 1e9);
    store_->append({{channel, {begin_ + ns}, sequence_++, {}, bytesOf(message)}});
    if (topic != "/joint_states") topics_.push_back(topic);
  }
  /// Of what was added since the last one.
  std::int64_t addBehavior(double seconds) {
    replay::Behavior behavior;
    behavior.recording = recording_;
    behavior.name = "reach";
    behavior.begin = {begin_};
    behavior.end = replay::Stamp{begin_ + static_cast<std::int64_t>(seconds * 1e9)};
    behavior.topics = std::exchange(topics_, {});
    begin_ += 1000 * 1000 * kMs;
    return store_->addBehavior(behavior);
  }

 private:
  std::unique_ptr<replay::Store> store_;
  std::int64_t recording_;
  std::int64_t begin_ = kBegin;
  std::uint64_t sequence_ = 0;
  std::vector<std::string> topics_;
};

/// The robot: hears velocities, goals and cancels, and notes when.
class Robot {
 public:
  Robot() {
    velocities_ = node_.subscribe("/cmd_vel", 1000, &Robot::onVelocity, this);
    goals_ = node_.subscribe(kArm + "/goal", 10, &Robot::onGoal, this);
    cancels_ = node_.subscribe(kArm + "/cancel", 100, &Robot::onCancel, this);
    statuses_ = node_.advertise<actionlib_msgs::GoalStatusArray>(kArm + "/status", 10, true);
    joints_ = node_.advertise<sensor_msgs::JointState>("/joint_states", 10);
    timer_ = node_.createWallTimer(ros::WallDuration(0.02), &Robot::onTimer, this);
  }
  void forget() {
    const std::lock_guard<std::mutex> lock(mutex_);
    moves_ = reaches_ = false;
    stopped_ = canceled_ = std::nullopt;
  }
  bool isInMotion() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return moves_ && reaches_;
  }
  bool drives() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return moves_;
  }
  /// When the first zero velocity came after the last other one; and the first cancel.
  std::optional<Moment> stopped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return stopped_;
  }
  std::optional<Moment> canceled() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return canceled_;
  }

 private:
  void onTimer(const ros::WallTimerEvent&) {
    sensor_msgs::JointState state;
    state.name = {"elbow"};
    state.position = {0.1};
    joints_.publish(state);
  }
  void onVelocity(const geometry_msgs::Twist& twist) {
    const std::lock_guard<std::mutex> lock(mutex_);
    moves_ = twist.linear.x != 0;
    if (moves_) stopped_ = std::nullopt;
    if (!moves_ && !stopped_) stopped_ = std::chrono::steady_clock::now();
  }
  void onGoal(const control_msgs::FollowJointTrajectoryActionGoal&) {
    const std::lock_guard<std::mutex> lock(mutex_);
    reaches_ = true;
  }
  void onCancel(const actionlib_msgs::GoalID&) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!canceled_) canceled_ = std::chrono::steady_clock::now();
  }

  mutable std::mutex mutex_;
  bool moves_ = false, reaches_ = false;
  std::optional<Moment> stopped_, canceled_;
  ros::NodeHandle node_;
  ros::Subscriber velocities_, goals_, cancels_;
  ros::Publisher statuses_, joints_;
  ros::WallTimer timer_;
};

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
    sensor_msgs::JointState state;
    state.name = {"elbow"};
    state.position = {0.52};
    memory.add("/joint_states", 0.01, state);
    memory.add(kArm + "/goal", 0.1, elbowGoal());
    from_elsewhere = memory.addBehavior(1);
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
  std::int64_t long_behavior = 0, from_elsewhere = 0, of_another_robot = 0, of_another_arm = 0;
  std::unique_ptr<ros::NodeHandle> node;
  std::unique_ptr<Robot> robot;
  std::unique_ptr<ros::AsyncSpinner> spinner;
};

bool isRegistered(const std::string& node) {
  std::vector<std::string> nodes;
  ros::master::getNodes(nodes);
  return std::count(nodes.begin(), nodes.end(), node) > 0;
}

/// As `rosnode kill` does it, and the master when a node of the same name comes.
void rosKill(const std::string& node) {
  XmlRpc::XmlRpcValue question, answer, address, request, done;
  question[0] = request[0] = ros::this_node::getName();
  question[1] = node;
  request[1] = "user request";
  ASSERT_TRUE(ros::master::execute("lookupNode", question, answer, address, false)) << node;
  std::string host;
  std::uint32_t port = 0;
  ASSERT_TRUE(ros::network::splitURI(address, host, port)) << node;
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  EXPECT_TRUE(client.execute("shutdown", request, done)) << node;
}

/// The watchdog's process: the player's child.
pid_t guardOf(pid_t player) {
  const std::filesystem::path tasks = "/proc/" + std::to_string(player) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks)) {
    pid_t child = 0;
    if (std::ifstream(task.path() / "children") >> child) return child;
  }
  return 0;
}

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
        "_hold:=0"};
    arguments.insert(arguments.end(), parameters.begin(), parameters.end());
    player = std::make_unique<test::NodeProcess>(arguments);
    client = std::make_unique<Client>(name + "/replay", false);
    ASSERT_TRUE(client->waitForServer(ros::Duration(30))) << player->log();
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
  EXPECT_EQ(resultText(),
            "the watchdog stopped the robot: the player was silent for more than 60 ms in motion");
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
  EXPECT_EQ(resultText(),
            "motion is refused: nothing is heard of the emergency stop on /live_estop");
}

// ------------------------------------------------------------------------------------- the checks

TEST_F(ReplayGuard, refusesToStartFromElsewhere) {
  play(world->from_elsewhere);
  EXPECT_EQ(resultText(),
            "motion is refused: the robot does not stand as it did: elbow is 0.42 rad off (now "
            "0.10, then 0.52)");
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

// ----------------------------------------------------------------------- who is told to end, ends
// after the robot

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
