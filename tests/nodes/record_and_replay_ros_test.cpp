// recorder_node and player_node as a robot runs them: processes of their own, one master.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/RecordBehaviorAction.h>
#include <afterglow/ReplayAction.h>
#include <afterglow/ReplayStatus.h>
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <std_msgs/String.h>
#include <std_msgs/UInt64.h>
#include <std_srvs/Trigger.h>
#include <topic_tools/shape_shifter.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "nodes/tools/ros_graph.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/messages.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_bytes.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::record_and_replay_ros_test {
namespace {

using test::rosBytes;
using replay::Bytes;
using test::eventually;
using State = actionlib::SimpleClientGoalState;
using Recorder = actionlib::SimpleActionClient<RecordBehaviorAction>;
using Replayer = actionlib::SimpleActionClient<ReplayAction>;

const ros::Duration kPatience(30);

std_msgs::String say(const std::string& text) {
  std_msgs::String message;
  message.data = text;
  return message;
}

std_msgs::UInt64 number(std::uint64_t value) {
  std_msgs::UInt64 message;
  message.data = value;
  return message;
}

/// Hears any topic, as bytes.
class Ear {
 public:
  explicit Ear(const std::string& topic)
      : subscriber_(node_.subscribe<topic_tools::ShapeShifter>(
            topic, 0, [this](const topic_tools::ShapeShifter::ConstPtr& message) {
              Bytes bytes(message->size());
              ros::serialization::OStream stream(bytes.data(), message->size());
              message->write(stream);
              const std::lock_guard<std::mutex> lock(mutex_);
              heard_.push_back(std::move(bytes));
            })) {}
  std::vector<Bytes> heard() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return heard_;
  }
  bool heardSoFar(std::size_t count) const {
    return eventually([&] { return heard().size() >= count; });
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Bytes> heard_;
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
};

struct World {
  World() {
    node = std::make_unique<ros::NodeHandle>();
    spinner.start();
    player = startPlayer("player_node", "true");
    recorder = std::make_unique<test::NodeProcess>(std::vector<std::string>{
        AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + storePath, "_robot:=fetch7"});
  }
  ~World() { spinner.stop(); }

  std::unique_ptr<test::NodeProcess> startPlayer(const std::string& name,
                                                 const std::string& allow_motion) const {
    return std::make_unique<test::NodeProcess>(std::vector<std::string>{
        AFTERGLOW_TEST_PLAYER_NODE, "__name:=" + name, "replay:=/" + name + "/replay",
        "_store:=" + storePath, "_hold:=0.1", "_longest_stall:=1", "_report_folder:=" + reports,
        "_allow_motion:=" + allow_motion, "_open_loop:=true", "_no_scan:=true"});
  }

  test::TempFolder folder;
  std::string storePath = folder.path("behaviors.db");
  std::string reports = folder.path("reports");
  test::TestGraph graph;
  std::unique_ptr<ros::NodeHandle> node;
  ros::AsyncSpinner spinner{3};
  std::unique_ptr<test::NodeProcess> recorder, player;
};

class RecordAndReplay : public testing::Test {
 public:
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() {
    delete world;
    ros::shutdown();
  }

  template <typename Message>
  ros::Publisher advertise(const std::string& topic, bool latches = false) {
    return world->node->advertise<Message>(topic, 1000, latches);
  }
  static std::unique_ptr<replay::Store> openStore() {
    return replay::openStore(world->storePath, replay::OpenMode::ReadOnly);
  }
  static std::vector<Bytes> stored(std::int64_t id, const std::string& topic) {
    const auto store = openStore();
    std::vector<Bytes> bytes;
    const auto cursor = store->messages(store->behavior(id).value(), {{topic}, {}, {}});
    while (auto message = cursor->next()) bytes.push_back(std::move(message->bytes));
    return bytes;
  }

  static StartRecording::Response startRecording(const std::string& name,
                                                 const std::vector<std::string>& topics) {
    StartRecording call;
    call.request.name = name;
    call.request.topics = topics;
    EXPECT_TRUE(ros::service::waitForService("/recorder_node/start_recording", kPatience));
    EXPECT_TRUE(ros::service::call("/recorder_node/start_recording", call));
    return call.response;
  }
  static StopRecording::Response stopRecording(std::int64_t id, const std::string& outcome) {
    StopRecording call;
    call.request.behavior_id = id;
    call.request.outcome = outcome;
    EXPECT_TRUE(ros::service::call("/recorder_node/stop_recording", call));
    return call.response;
  }
  static std_srvs::Trigger::Response trigger(const std::string& service) {
    std_srvs::Trigger call;
    EXPECT_TRUE(ros::service::waitForService(service, kPatience));
    EXPECT_TRUE(ros::service::call(service, call));
    return call.response;
  }

  /// Replays to the end; the result's state and text.
  static State replay(const ReplayGoal& goal, ReplayResult* result = nullptr,
                      const std::string& player = "player_node") {
    Replayer client("/" + player + "/replay", false);
    EXPECT_TRUE(client.waitForServer(kPatience));
    client.sendGoal(goal);
    EXPECT_TRUE(client.waitForResult(kPatience));
    if (result) *result = *client.getResult();
    return client.getState();
  }
  static ReplayGoal goalOf(std::int64_t id, const std::string& only = "") {
    ReplayGoal goal;
    goal.behavior = std::to_string(id);
    if (!only.empty()) goal.options = {"only=" + only};
    return goal;
  }

  /// A behavior made by hand: velocities every 100 ms for so long.
  static std::int64_t longDrive(std::int64_t seconds) {
    const auto store = replay::openStore(world->storePath, replay::OpenMode::ReadWrite);
    const std::int64_t recording = store->addRecording({0, "", "by hand", ""});
    replay::Channel channel = test::twistChannel("/drive");
    channel.md5 = ros::message_traits::MD5Sum<geometry_msgs::Twist>::value();
    const std::int64_t channel_id = store->addChannel(recording, channel);
    std::vector<replay::Message> messages;
    for (std::int64_t i = 0; i < seconds * 10; ++i) {
      messages.push_back(
          {channel_id, {i * 100'000'000}, static_cast<std::uint64_t>(i), {}, test::twist(0.2)});
    }
    store->append(messages);
    replay::Behavior behavior;
    behavior.recording = recording;
    behavior.name = "drive";
    behavior.topics = {"/drive"};
    behavior.end = replay::Stamp{seconds * 1'000'000'000};
    return store->addBehavior(behavior);
  }

  static World* world;
};
World* RecordAndReplay::world = nullptr;

TEST_F(RecordAndReplay, recordsByActionEverythingFromStartToStopAndReplaysItByteForByte) {
  constexpr std::uint64_t kTicks = 100;
  const Bytes welcome = rosBytes(say("welcome"));
  RecordBehaviorResult recorded;
  {
    ros::Publisher sign = advertise<std_msgs::String>("/sign", true);
    ros::Publisher ticks = advertise<std_msgs::UInt64>("/ticks");
    sign.publish(say("outdated"));
    sign.publish(say("welcome"));
    Recorder client("/record_behavior", false);
    ASSERT_TRUE(client.waitForServer(kPatience));
    std::atomic<bool> is_started{false};
    RecordBehaviorGoal goal;
    goal.name = "pick";
    goal.topics = {"/sign", "/ticks", "/late", "/silent"};
    goal.tree_path = "kitting/pick";
    goal.parameters = R"({"object": "gear"})";
    client.sendGoal(goal, {}, {},
                    [&](const RecordBehaviorFeedbackConstPtr&) { is_started = true; });
    ASSERT_TRUE(eventually([&] { return is_started.load(); }));
    ros::Publisher late;
    ros::WallRate rate(100);
    for (std::uint64_t i = 0; i < kTicks; ++i) {
      ticks.publish(number(i));
      if (i == kTicks / 2) late = advertise<std_msgs::String>("/late");
      rate.sleep();
    }
    ASSERT_TRUE(eventually([&] { return late.getNumSubscribers() > 0; }));
    late.publish(say("last"));
    ASSERT_TRUE(stopRecording(0, "success").success);
    ASSERT_TRUE(client.waitForResult(kPatience));
    EXPECT_EQ(client.getState(), State::SUCCEEDED) << client.getState().getText();
    recorded = *client.getResult();
  }
  EXPECT_EQ(recorded.messages, kTicks + 2);
  EXPECT_EQ(recorded.dropped, 0u);
  EXPECT_EQ(recorded.silent_topics, std::vector<std::string>{"/silent"});
  const replay::Behavior behavior = openStore()->behavior(recorded.behavior_id).value();
  EXPECT_EQ(behavior.outcome, "success");
  EXPECT_EQ(behavior.robot, "fetch7");
  EXPECT_EQ(behavior.tree_path, "kitting/pick");
  EXPECT_EQ(stored(behavior.id, "/sign"), std::vector<Bytes>{welcome});
  EXPECT_EQ(replay(goalOf(behavior.id)).getText(),
            "behavior " + std::to_string(behavior.id) +
                " 'pick': there is nothing to play; not played, as nobody named them: /late, "
                "/sign, /ticks; --also TOPIC plays one, --dry-run says why each is left out")
      << "they are neither body, light nor speech";

  for (int time = 1; time <= 2; ++time) {
    const Ear sign("/sign"), ticks("/ticks"), late("/late");
    ReplayResult result;
    ReplayGoal goal = goalOf(behavior.id, "ar");
    goal.options.push_back("also=/sign,/ticks,/late");
    const State state = replay(goal, &result);
    EXPECT_EQ(state, State::SUCCEEDED) << state.getText();
    EXPECT_TRUE(result.completed);
    ASSERT_TRUE(ticks.heardSoFar(kTicks) && sign.heardSoFar(1) && late.heardSoFar(1));
    EXPECT_EQ(sign.heard(), std::vector<Bytes>{welcome});
    EXPECT_EQ(ticks.heard(), stored(behavior.id, "/ticks"));
    EXPECT_EQ(late.heard(), std::vector<Bytes>{rosBytes(say("last"))});
    const auto report = nlohmann::json::parse(result.report);
    EXPECT_EQ(report["topics"]["/ticks"]["published"], kTicks);
    EXPECT_EQ(report["topics"]["/ticks"]["heard"], true);
  }
}

TEST_F(RecordAndReplay, recordsByServiceSeveralBehaviorsAtOnce) {
  ros::Publisher topic = advertise<std_msgs::String>("/talk");
  const auto outer = startRecording("kitting", {"/talk"});
  ASSERT_TRUE(outer.success) << outer.message;
  topic.publish(say("1"));
  const auto inner = startRecording("place", {"/talk", "/talk"});
  ASSERT_TRUE(inner.success) << inner.message;
  topic.publish(say("2"));
  const auto inner_end = stopRecording(inner.behavior_id, "failure");
  EXPECT_EQ(inner_end.messages, 1u);
  topic.publish(say("3"));
  const auto outer_end = stopRecording(0, "");
  EXPECT_EQ(outer_end.behavior_id, outer.behavior_id);
  EXPECT_EQ(outer_end.messages, 3u);
  EXPECT_EQ(openStore()->behavior(inner.behavior_id)->outcome, "failure");
  EXPECT_EQ(openStore()->behavior(outer.behavior_id)->outcome, "stopped");
}

TEST_F(RecordAndReplay, refusesWhatCannotBeRecorded) {
  EXPECT_EQ(startRecording("", {"/a"}).message, "name is empty: a behavior is found by its name");
  EXPECT_EQ(startRecording("pick", {"cmd_vel"}).message,
            "'cmd_vel' is no topic: it begins with no slash");
  EXPECT_FALSE(startRecording("pick", {}).success);
  EXPECT_FALSE(startRecording("pick", {"/a b"}).success);
  EXPECT_EQ(startRecording("pick", {"/a/"}).message, "'/a/' is no clean name: '/a' is");
  EXPECT_EQ(stopRecording(4711, "").message, "behavior 4711 is not being recorded");
  EXPECT_EQ(stopRecording(0, "").message, "nothing is being recorded");
  Recorder client("/record_behavior", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  client.sendGoal({});
  ASSERT_TRUE(client.waitForResult(kPatience));
  EXPECT_EQ(client.getState(), State::REJECTED);
}

TEST_F(RecordAndReplay, endsARecordingThatIsCanceledAsStopped) {
  Recorder client("/record_behavior", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  RecordBehaviorGoal goal;
  goal.name = "canceled";
  goal.topics = {"/nobody"};
  client.sendGoal(goal);
  ASSERT_TRUE(eventually([&] { return client.getState() == State::ACTIVE; }));
  client.cancelGoal();  // perhaps before the recording has started
  ASSERT_TRUE(client.waitForResult(kPatience));
  EXPECT_EQ(client.getState(), State::PREEMPTED);
  ASSERT_EQ(client.getResult()->outcome, "stopped");
  EXPECT_EQ(openStore()->behavior(client.getResult()->behavior_id)->outcome, "stopped");
}

/// As rosbag play gives it, which has a publisher for each recorded connection.
TEST_F(RecordAndReplay, givesALateSubscriberTheLastOfEachLatchedPublisher) {
  std::int64_t id = 0;
  {
    const auto store = replay::openStore(world->storePath, replay::OpenMode::ReadWrite);
    const std::int64_t recording = store->addRecording({0, "", "by hand", ""});
    std::uint64_t sequence = 0;
    const auto add = [&](const char* node, bool latches, const std::string& text) {
      replay::Message message;
      message.channel = store->addChannel(
          recording, {"/notes", "std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1",
                      "string data\n", latches, node});
      message.sequence = ++sequence;
      message.received = {1'000'000'000 + static_cast<std::int64_t>(sequence) * 10'000'000};
      message.bytes = rosBytes(say(text));
      store->append({message});
    };
    add("/plain", false, "not kept");
    add("/one", true, "of one");
    add("/two", true, "of two");
    add("/one", true, "of one, later");
    add("/plain", false, "not kept either");
    replay::Behavior behavior;
    behavior.recording = recording;
    behavior.name = "notes";
    behavior.begin = {1'000'000'000};
    behavior.end = replay::Stamp{1'100'000'000};
    behavior.topics = {"/notes"};
    id = store->addBehavior(behavior);
  }
  std::optional<Ear> early("/notes");
  ReplayGoal goal = goalOf(id);
  goal.options = {"also=/notes", "keep_alive=true"};
  Replayer client("/player_node/replay", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  client.sendGoal(goal);
  ASSERT_TRUE(early->heardSoFar(5));
  early.reset();  // what one node subscribes to twice has one connection, of which it keeps one
  const Ear late("/notes");
  ASSERT_TRUE(late.heardSoFar(2));
  std::vector<Bytes> heard = late.heard();
  std::sort(heard.begin(), heard.end());
  std::vector<Bytes> expected{rosBytes(say("of one, later")), rosBytes(say("of two"))};
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(heard, expected);
  client.cancelGoal();
  EXPECT_TRUE(client.waitForResult(kPatience));
}

TEST_F(RecordAndReplay, endsADriveWithAZeroTwist) {
  const std::int64_t id = longDrive(1);
  const Ear base("/drive");
  std::filesystem::remove_all(world->reports);
  std::ofstream(world->reports) << "in the way";
  {
    const State state = replay(goalOf(id));
    EXPECT_EQ(state, State::SUCCEEDED) << state.getText();
  }
  ASSERT_TRUE(base.heardSoFar(11));
  EXPECT_EQ(base.heard().front(), test::twist(0.2));
  EXPECT_EQ(base.heard().back(), test::twist(0));
  EXPECT_NE(world->player->log().find("the report was not kept: "), std::string::npos)
      << world->player->log();
}

TEST_F(RecordAndReplay, keepsAReportOfEachReplay) {
  const std::int64_t id = longDrive(1);
  const Ear base("/drive");
  std::filesystem::remove_all(world->reports);
  ReplayResult result;
  EXPECT_EQ(replay(goalOf(id), &result), State::SUCCEEDED);
  std::map<std::string, std::string> kept;
  for (const auto& file : std::filesystem::directory_iterator(world->reports)) {
    std::ifstream text(file.path());
    kept[file.path().extension()] = std::string(std::istreambuf_iterator<char>(text), {});
  }
  ASSERT_EQ(kept.size(), 2u);
  const auto json = nlohmann::json::parse(kept[".json"]);
  EXPECT_EQ(json, nlohmann::json::parse(result.report));
  EXPECT_EQ(json["behavior_id"], id);
  ASSERT_EQ(json["body"]["not_known"].size(), 1u) << json["body"].dump();
  EXPECT_NE(kept[".html"].find("Replay of drive"), std::string::npos);
}

TEST_F(RecordAndReplay, refusesASecondDriverButNotAnIdleOne) {
  const std::int64_t id = longDrive(1);
  const Ear base("/drive");
  ros::Publisher teleop = advertise<geometry_msgs::Twist>("/drive");
  EXPECT_EQ(replay(goalOf(id)), State::SUCCEEDED) << "it could drive, but it does not";
  ReplayResult result;
  const ros::WallTimer driving = world->node->createWallTimer(
      ros::WallDuration(0.02), [teleop](const auto&) { teleop.publish(geometry_msgs::Twist()); });
  const State state = replay(goalOf(id), &result);
  EXPECT_EQ(state, State::ABORTED);
  EXPECT_EQ(state.getText(), "/test drives on /drive, too: two drivers of one base are refused");
  EXPECT_EQ(nlohmann::json::parse(result.report)["topics"]["/drive"]["published"], 0);
}

TEST_F(RecordAndReplay, endsWhenAnIdleDriverBeginsToDriveInMotion) {
  const std::int64_t id = longDrive(60);
  const Ear base("/drive");
  ros::Publisher teleop = advertise<geometry_msgs::Twist>("/drive");
  Replayer client("/player_node/replay", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  client.sendGoal(goalOf(id));
  ASSERT_TRUE(base.heardSoFar(3));
  const ros::WallTimer driving = world->node->createWallTimer(
      ros::WallDuration(0.02), [teleop](const auto&) { teleop.publish(geometry_msgs::Twist()); });
  ASSERT_TRUE(client.waitForResult(kPatience));
  EXPECT_EQ(client.getState(), State::ABORTED);
  EXPECT_EQ(client.getState().getText(),
            "/test drives on /drive, too: two drivers of one base are refused");
}

TEST_F(RecordAndReplay, refusesWhatIsNotThereAndMotionThatIsNotAllowed) {
  ReplayGoal unknown;
  unknown.behavior = "dance";
  EXPECT_EQ(replay(unknown).getText().find("there is no behavior \"dance\""), 0u);
  EXPECT_EQ(replay(goalOf(4711)).getText(), "there is no behavior 4711");
  EXPECT_EQ(replay({}).getText(), "no behavior is named: give its id or its name");
  const std::int64_t id = longDrive(1);
  const auto careful = world->startPlayer("careful", "false");
  const State state = replay(goalOf(id), nullptr, "careful");
  EXPECT_EQ(state, State::ABORTED);
  EXPECT_NE(state.getText().find("motion is not allowed here"), std::string::npos);
  EXPECT_NE(state.getText().find("/drive"), std::string::npos);
}

TEST_F(RecordAndReplay, pausesResumesAndStopsByService) {
  EXPECT_EQ(trigger("/player_node/pause").message, "nothing is being replayed");
  const std::int64_t id = longDrive(60);
  std::mutex mutex;
  ReplayStatus status;
  const ros::Subscriber subscriber = world->node->subscribe<ReplayStatus>(
      "/player_node/status", 10, [&](const ReplayStatusConstPtr& message) {
        const std::lock_guard<std::mutex> lock(mutex);
        status = *message;
      });
  const auto reaches = [&](std::uint8_t state) {
    return eventually([&] {
      const std::lock_guard<std::mutex> lock(mutex);
      return status.state == state;
    });
  };
  const Ear base("/drive");
  Replayer client("/player_node/replay", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  client.sendGoal(goalOf(id));
  ASSERT_TRUE(base.heardSoFar(2));
  EXPECT_TRUE(trigger("/player_node/pause").success);
  ASSERT_TRUE(reaches(ReplayStatus::PAUSED));
  ASSERT_TRUE(eventually([&] { return base.heard().back() == test::twist(0); }));
  const std::size_t heard = base.heard().size();
  const auto asOther = [](const std::string& service) {
    test::NodeProcess other({"/usr/bin/python3", "/usr/bin/rosservice", "call", service});
    EXPECT_EQ(other.exitStatus(), 0);
    return other.log();
  };
  for (const char* service : {"resume", "toggle_paused", "play_next"}) {
    EXPECT_NE(asOther(std::string("/player_node/") + service).find("it was paused by /"),
              std::string::npos)
        << service;
  }
  trigger("/player_node/play_next");  // motion is not played so
  EXPECT_NE(asOther("/player_node/resume").find("it was paused by /"), std::string::npos)
      << "who asks for the next message has not resumed it";
  EXPECT_NE(asOther("/player_node/pause").find("success: True"), std::string::npos);
  EXPECT_EQ(trigger("/player_node/resume").message,
            "it was paused by /rosservice: it goes on only when that resumes it; ~stop ends it");
  EXPECT_EQ(base.heard().back(), test::twist(0));
  EXPECT_NE(asOther("/player_node/resume").find("success: True"), std::string::npos)
      << "each call is a node of its own";
  ASSERT_TRUE(base.heardSoFar(heard + 2));
  EXPECT_TRUE(reaches(ReplayStatus::PLAYING));
  EXPECT_TRUE(trigger("/player_node/stop").success);
  ASSERT_TRUE(client.waitForResult(kPatience));
  EXPECT_EQ(client.getState(), State::ABORTED);
  EXPECT_EQ(client.getState().getText(), "stopped");
  EXPECT_FALSE(client.getResult()->completed);
  ASSERT_TRUE(eventually([&] { return base.heard().back() == test::twist(0); }));
  ASSERT_TRUE(reaches(ReplayStatus::IDLE));
  EXPECT_EQ(status.message, "stopped");
}

TEST_F(RecordAndReplay, stopsTheRobotOnCtrlC) {
  const std::int64_t id = longDrive(60);
  const auto player = world->startPlayer("interrupted_player", "true");
  const Ear base("/drive");
  Replayer client("/interrupted_player/replay", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  client.sendGoal(goalOf(id));
  ASSERT_TRUE(base.heardSoFar(3));
  player->interrupt();
  EXPECT_EQ(player->exitStatus(), 0) << player->log();
  ASSERT_TRUE(eventually([&] { return base.heard().back() == test::twist(0); }));
}

TEST_F(RecordAndReplay, replaysFromTheCommandAndStopsTheRobotOnCtrlC) {
  const std::string id = std::to_string(longDrive(60));
  const Ear base("/drive");
  test::NodeProcess forbidden({AFTERGLOW_TEST_COMMAND, "play", id, "--store", world->storePath});
  EXPECT_EQ(forbidden.exitStatus(), 1);
  EXPECT_NE(forbidden.log().find("motion is not allowed here"), std::string::npos);
  test::NodeProcess yaml({AFTERGLOW_TEST_COMMAND, "play", id, "--report", "report.yaml"});
  EXPECT_NE(yaml.exitStatus(), 0);
  EXPECT_NE(yaml.log().find("report.yaml has to end with .json, .txt or .html"), std::string::npos);
  const std::string report = world->folder.path("stopped.html");
  test::NodeProcess command({AFTERGLOW_TEST_COMMAND, "play", id, "--store", world->storePath,
                             "--allow-motion", "--open-loop", "--no-scan", "--report", report});
  ASSERT_TRUE(base.heardSoFar(3)) << command.log();
  command.interrupt();
  EXPECT_EQ(command.exitStatus(), 1);
  EXPECT_NE(command.log().find("stopped by a signal"), std::string::npos) << command.log();
  EXPECT_NE(command.log().find("' was stopped after "), std::string::npos) << command.log();
  std::ifstream page(report);
  const std::string text(std::istreambuf_iterator<char>(page), {});
  EXPECT_NE(text.find("Stopped: stopped by a signal"), std::string::npos);
  ASSERT_TRUE(eventually([&] { return base.heard().back() == test::twist(0); }));
}

// Last: it ends the recorder.
TEST_F(RecordAndReplay, zzEndsRunningBehaviorsAsInterruptedOnCtrlC) {
  ros::Publisher topic = advertise<std_msgs::String>("/talk");
  const auto started = startRecording("interrupted", {"/talk"});
  ASSERT_TRUE(started.success);
  topic.publish(say("kept"));
  ASSERT_TRUE(eventually([&] { return stored(started.behavior_id, "/talk").size() == 1; }));
  world->recorder->interrupt();
  EXPECT_EQ(world->recorder->exitStatus(), 0) << world->recorder->log();
  EXPECT_EQ(openStore()->behavior(started.behavior_id)->outcome, "interrupted");
  EXPECT_EQ(stored(started.behavior_id, "/talk").size(), 1u);
}

TEST(Nodes, endOnASignalWhileThereIsNoMaster) {
  for (const char* program : {AFTERGLOW_TEST_RECORDER_NODE, AFTERGLOW_TEST_PLAYER_NODE}) {
    for (const int signal : {SIGTERM, SIGINT}) {
      test::NodeProcess node({program, "__master:=http://127.0.0.1:1", "_store:=/none"});
      ASSERT_TRUE(test::eventually(
          [&] { return node.log().find("waiting for a ROS master") != std::string::npos; }))
          << node.log();
      node.signal(signal);
      EXPECT_EQ(node.exitStatus(), 0) << node.log();
    }
  }
}

TEST(Nodes, explainThemselvesAndDoNothingElse) {
  for (const char* program : {AFTERGLOW_TEST_RECORDER_NODE, AFTERGLOW_TEST_PLAYER_NODE}) {
    test::NodeProcess node({program, "--help"});
    EXPECT_EQ(node.exitStatus(), 0);
    EXPECT_NE(node.log().find("usage: "), std::string::npos) << node.log();
  }
}

}  // namespace
}  // namespace afterglow::nodes::record_and_replay_ros_test
