// What is published of a recording that holds everything, heard from outside: what nobody asked for
// is not.
#include <afterglow/PlayBehavior.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <nav_msgs/OccupancyGrid.h>
#include <nav_msgs/Path.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>
#include <sound_play/SoundRequest.h>
#include <std_msgs/String.h>
#include <std_srvs/Trigger.h>
#include <topic_tools/shape_shifter.h>
#include <visualization_msgs/Marker.h>
#include <xmlrpcpp/XmlRpc.h>

#include <cstdlib>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_bytes.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::default_deny_ros_test {
namespace {

using test::rosBytes;
using test::rosChannel;
using Texts = std::vector<std::string>;
using test::eventually;

constexpr std::int64_t kBegin = 1'600'000'000'000'000'000;

/// One that the test's machine may lack the package of: an empty text under its name.
replay::Channel madeUp(const std::string& topic, const std::string& type) {
  return {topic, type, std::string(32, 'a'), "string data\n", false, "/recorded"};
}

struct Recorded {
  replay::Channel channel;
  replay::Bytes bytes;
};

template <typename Ros>
Recorded blank(const std::string& topic) {
  return {rosChannel<Ros>(topic), rosBytes(Ros())};
}

/// As `rosbag record -a` on a Fetch that navigates, and what UR, TIAGo and TurtleBot add.
std::vector<Recorded> everything() {
  std::vector<Recorded> all{blank<sensor_msgs::Joy>("/joy"),
                            blank<geometry_msgs::PoseWithCovarianceStamped>("/initialpose"),
                            blank<sensor_msgs::LaserScan>("/base_scan"),
                            blank<sensor_msgs::LaserScan>("/base_scan_raw"),
                            blank<nav_msgs::OccupancyGrid>("/map"),
                            blank<sensor_msgs::JointState>("/joint_states"),
                            blank<sensor_msgs::PointCloud2>("/head_camera/depth/points"),
                            blank<std_msgs::String>("/voice_command"),
                            blank<visualization_msgs::Marker>("/projector/marks"),
                            blank<nav_msgs::Path>("/path"),
                            blank<sensor_msgs::PointCloud2>("/projector/points"),
                            blank<sound_play::SoundRequest>("/robotsound")};
  for (const auto& [topic, type] : std::vector<std::pair<const char*, const char*>>{
           {"/cmd_vel", "geometry_msgs/Twist"},
           {"/teleop/cmd_vel", "geometry_msgs/Twist"},
           {"/base_controller/command", "geometry_msgs/Twist"},
           {"/cmd_vel_mux/selected", "std_msgs/String"},
           {"/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped"},
           {"/particlecloud", "geometry_msgs/PoseArray"},
           {"/map_updates", "map_msgs/OccupancyGridUpdate"},
           {"/move_base/goal", "move_base_msgs/MoveBaseActionGoal"},
           {"/move_base_simple/goal", "geometry_msgs/PoseStamped"},
           {"/move_base/cancel", "actionlib_msgs/GoalID"},
           {"/clicked_point", "geometry_msgs/PointStamped"},
           {"/enable_software_runstop", "std_msgs/Bool"},
           {"/software_runstop_enabled", "std_msgs/Bool"},
           {"/estop", "std_msgs/Bool"},
           {"/motor_power", "std_msgs/Bool"},
           {"/reset", "std_msgs/Empty"},
           {"/arm_controller/follow_joint_trajectory/goal",
            "control_msgs/FollowJointTrajectoryActionGoal"},
           {"/arm_controller/follow_joint_trajectory/result",
            "control_msgs/FollowJointTrajectoryActionResult"},
           {"/move_group/status", "actionlib_msgs/GoalStatusArray"},
           {"/collision_object", "moveit_msgs/CollisionObject"},
           {"/planning_scene", "moveit_msgs/PlanningScene"},
           {"/trajectory_execution_event", "std_msgs/String"},
           {"/joint_position_controller/set_point", "std_msgs/Float64"},
           {"/wheel_left/effort", "std_msgs/Float64"},
           {"/group_controller/velocity", "std_msgs/Float64MultiArray"},
           {"/ackermann_cmd", "ackermann_msgs/AckermannDrive"},
           {"/ur_driver/URScript", "std_msgs/String"},
           {"/head_camera/rgb/image_raw", "sensor_msgs/Image"},
           {"/imu", "sensor_msgs/Imu"},
           {"/odom", "nav_msgs/Odometry"},
           {"/odom_combined", "nav_msgs/Odometry"},
           {"/tf", "tf2_msgs/TFMessage"},
           {"/diagnostics", "diagnostic_msgs/DiagnosticArray"},
           {"/interactive_markers/feedback", "visualization_msgs/InteractiveMarkerFeedback"}}) {
    all.push_back({madeUp(topic, type), replay::Bytes(4, 0)});
  }
  return all;
}

/// A store of two behaviors over the same messages.
struct EverythingBag {
  explicit EverythingBag(const std::string& path) {
    const auto store = replay::openStore(path, replay::OpenMode::ReadWrite);
    const std::int64_t recording = store->addRecording({0, "", "by hand", ""});
    std::uint64_t sequence = 0;
    for (const Recorded& recorded : everything()) {
      const std::int64_t channel = store->addChannel(recording, recorded.channel);
      topics.push_back(recorded.channel.topic);
      replay::Message message;
      message.channel = channel;
      message.received = {kBegin + 1'000'000 * static_cast<std::int64_t>(++sequence)};
      message.sequence = sequence;
      message.bytes = recorded.bytes;
      store->append({message});
    }
    replay::Behavior behavior;
    behavior.recording = recording;
    behavior.name = "everything";
    behavior.begin = {kBegin};
    behavior.end = replay::Stamp{kBegin + 100'000'000};
    behavior.topics = topics;
    imported = std::to_string(store->addBehavior(behavior));
    replay::Snapshot snapshot;
    snapshot.requested = topics;
    behavior.snapshot = snapshot.toJson();
    requested = std::to_string(store->addBehavior(behavior));
  }
  Texts topics;
  std::string imported, requested;
};

struct World {
  test::TestGraph graph;
  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  EverythingBag bag{store};
  ros::NodeHandle node;
};

struct DefaultDeny : testing::Test {
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() {
    delete world;
    ros::shutdown();
  }
  static Texts command(const std::string& behavior, const Texts& options) {
    Texts words{AFTERGLOW_TEST_COMMAND, "play",        behavior,    "--store",     world->store,
                "--anchor",             "body",        "--no-keys", "--ungated",   "--keep-light",
                "--no-realtime"};
    words.insert(words.end(), options.begin(), options.end());
    return words;
  }
  /// What it says, refused or not.
  static std::string said(const std::string& behavior, const Texts& options, int status) {
    test::NodeProcess process(command(behavior, options));
    EXPECT_EQ(process.exitStatus(), status) << process.log();
    return process.log();
  }
  /// The topics that a replay publishes to whoever listens.
  static std::set<std::string> heard(const std::string& behavior, Texts options,
                                     const std::string& prefix = "",
                                     const std::set<std::string>& unheard = {}) {
    std::set<std::string> topics;
    std::mutex mutex;
    std::vector<ros::Subscriber> subscribers;
    for (const std::string& topic : world->bag.topics) {
      if (unheard.count(topic) != 0) continue;
      using Event = ros::MessageEvent<const topic_tools::ShapeShifter>;
      ros::SubscribeOptions listening;
      const auto take = [&, topic](const Event& event) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (event.getPublisherName().find("/afterglow_play") == 0) topics.insert(topic);
      };
      listening.initByFullCallbackType<const Event&>(prefix + topic, 10, take);
      subscribers.push_back(world->node.subscribe(listening));
    }
    ros::AsyncSpinner spinner(1);
    spinner.start();
    options.insert(options.end(), {"--wait-for-subscribers", "20"});
    said(behavior, options, 0);
    ros::WallDuration(1).sleep();  // what was sent has left, and may still be on its way
    spinner.stop();
    return topics;
  }
  static World* world;
};
World* DefaultDeny::world = nullptr;

using Names = std::set<std::string>;
const Names kLightAndSpeech{"/projector/marks", "/path", "/projector/points", "/robotsound"};

void ignore(const topic_tools::ShapeShifter&) {}
void obey(const geometry_msgs::Twist&) {}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(DefaultDeny, publishesLightAndSpeechAloneOfABagOfEverything) {
  ASSERT_GE(world->bag.topics.size(), 45u);
  EXPECT_EQ(heard(world->bag.requested, {"--only", "ar,speech"}), kLightAndSpeech);
  const std::string text = said(world->bag.requested, {"--only", "ar,speech"}, 0);
  EXPECT_TRUE(contains(text, "not played, as nobody named them: /")) << text;
  EXPECT_TRUE(contains(text, "; --also TOPIC plays one")) << text;
}

TEST_F(DefaultDeny, publishesNothingOfAnImportUnlessItIsNamed) {
  const std::string text = said(world->bag.imported, {"--only", "ar,speech"}, 1);
  EXPECT_TRUE(contains(text, "there is nothing to play of ar,speech; ")) << text;
  EXPECT_TRUE(contains(text, "--also /")) << text;
  EXPECT_TRUE(contains(said(world->bag.imported, {"--only", "ar", "--regex", "/.*"}, 1),
                       "there is nothing to play of ar"))
      << "a pattern names nothing";
  EXPECT_EQ(heard(world->bag.imported,
                  {"--only", "ar,speech", "--allow-motion", "--also", "/robotsound", "--also",
                   "/voice_command"}),
            (Names{"/robotsound", "/voice_command"}));
  EXPECT_EQ(heard(world->bag.imported, {"--topics", "/path"}), Names{"/path"});
}

TEST_F(DefaultDeny, showsTheLayersOfARunningProjector) {
  const ros::ServiceServer projector = ros::NodeHandle("~").advertiseService(
      "find_surfaces", +[](std_srvs::Trigger::Request&, std_srvs::Trigger::Response&) {
        return true;
      });
  const ros::Subscriber points = world->node.subscribe("/projector/points", 1, ignore);
  const ros::Subscriber scan = world->node.subscribe("/base_scan", 1, ignore);
  test::NodeProcess process(command(world->bag.imported, {"--only", "ar", "--dry-run", "--json"}));
  EXPECT_EQ(process.exitStatus(), 0);
  const std::string log = process.log();
  const auto topics = nlohmann::json::parse(log.substr(0, log.rfind('}') + 1))["topics"];
  EXPECT_EQ(topics["/projector/points"]["class"], "shown") << log;
  EXPECT_EQ(topics["/projector/points"]["why"], "it can be drawn, and a projector shows it");
  EXPECT_EQ(topics["/path"]["class"], "other");
  EXPECT_EQ(topics["/base_scan"]["class"], "other") << "old ranges hide people";
}

TEST_F(DefaultDeny, saysOfEachTopicWhatItIsWithoutAMaster) {
  const char* uri = getenv("ROS_MASTER_URI");
  const std::string master = uri;
  setenv("ROS_MASTER_URI", "http://localhost:1", 1);
  const std::string text = said(world->bag.imported, {"--dry-run"}, 0);
  setenv("ROS_MASTER_URI", master.c_str(), 1);
  EXPECT_TRUE(contains(text, "control input")) << text;
  EXPECT_TRUE(contains(text, "not played: a joystick: base and arm are driven by it")) << text;
  EXPECT_TRUE(contains(text, "endless motion")) << text;
  const std::string log = said(world->bag.imported, {"--dry-run", "--json"}, 0);
  const auto topics = nlohmann::json::parse(log.substr(0, log.rfind('}') + 1))["topics"];
  for (const auto& topic : topics) {
    EXPECT_FALSE(topic["class"].get<std::string>().empty());
    EXPECT_FALSE(topic["why"].get<std::string>().empty());
    const bool moves = topic["class"] == "body" || topic["class"] == "endless motion";
    EXPECT_TRUE(!moves || topic.count("stop") == 1) << topic;
  }
  EXPECT_EQ(topics["/cmd_vel"]["stop"], "zeros stop it");
  EXPECT_EQ(topics["/ur_driver/URScript"]["stop"], "nothing stops it that is known");
  EXPECT_TRUE(contains(text, "what a running projector would show is not known")) << text;
}

TEST_F(DefaultDeny, takesAProfileAtItsWordButForWhatNothingStops) {
  const std::string file = world->folder.path("my_robot.yaml");
  test::writeFile(file, "name: my_robot\ntopics: {control: [path], body: [joy]}\n");
  const std::string log = said(world->bag.imported, {"--dry-run", "--json", "--robot", file}, 0);
  const auto topics = nlohmann::json::parse(log.substr(0, log.rfind('}') + 1))["topics"];
  EXPECT_EQ(topics["/path"]["class"], "control input");
  EXPECT_EQ(topics["/joy"]["class"], "control input") << "still";
  EXPECT_TRUE(contains(said(world->bag.imported, {"--allow-motion", "--robot", file}, 1),
                       "/joy (sensor_msgs/Joy) is not played: the profile of my_robot calls it "
                       "body, but how it is stopped is not known (a joystick"));
}

TEST_F(DefaultDeny, printsItsTableAsTextAndAsJson) {
  test::NodeProcess text({AFTERGLOW_TEST_COMMAND, "play", "--classes"});
  EXPECT_EQ(text.exitStatus(), 0);
  EXPECT_TRUE(contains(text.log(), "\ncontrol input: a joystick: base and arm are driven by it\n"))
      << text.log();
  test::NodeProcess rows({AFTERGLOW_TEST_COMMAND, "play", "--classes", "--json"});
  EXPECT_EQ(rows.exitStatus(), 0);
  const auto json = nlohmann::json::parse(rows.log());
  ASSERT_GT(json.size(), 60u);
  EXPECT_EQ(json[0]["class"], "control input");
  EXPECT_EQ(json[0]["types"][0], "sensor_msgs/Joy*");
  EXPECT_TRUE(json[0]["stop"].is_null());
  test::NodeProcess fetch({AFTERGLOW_TEST_COMMAND, "play", "--classes", "--robot", "fetch"});
  EXPECT_EQ(fetch.exitStatus(), 0);
  EXPECT_TRUE(contains(fetch.log(), "the robot's profile says so, where it may\n  topics "))
      << fetch.log();
  EXPECT_FALSE(contains(text.log(), "profile says so"));
}

TEST_F(DefaultDeny, refusesMotionThatNothingStops) {
  const std::string text =
      said(world->bag.imported, {"--allow-motion", "--also", "/wheel_left/effort"}, 1);
  EXPECT_TRUE(contains(text, "/wheel_left/effort (std_msgs/Float64) is not played: its controller "
                             "goes on with the last value, whoever is gone"))
      << text;
  EXPECT_TRUE(contains(said(world->bag.requested, {"--allow-motion"}, 1), "/wheel_left/effort"))
      << "the recording was made for it";
}

TEST_F(DefaultDeny, recommendsNothingThatMovesWhereMotionIsNotAllowed) {
  const std::string text = said(world->bag.imported, {}, 1);
  EXPECT_TRUE(contains(text, "motion is not allowed here")) << text;
  EXPECT_FALSE(contains(text, "ar,speech")) << "nothing of it is shown: " << text;
  const std::string shown = said(world->bag.imported, {"--also", "/path"}, 1);
  EXPECT_FALSE(contains(shown, "/path")) << "it is played for its name: " << shown;
}

TEST_F(DefaultDeny, warnsOfControlInputsAndKeepsTheEmergencyStopItObeys) {
  const Texts joystick{"--only", "ar", "--also", "/joy"};
  EXPECT_TRUE(contains(said(world->bag.imported, joystick, 1),
                       "motion is not allowed here (~allow_motion, --allow-motion), and light and "
                       "speech alone are played without it, not /joy (control input: a joystick"));
  const std::string text =
      said(world->bag.imported, {"--only", "ar", "--also", "/joy", "--allow-motion"}, 0);
  EXPECT_TRUE(contains(text, "/joy is published as it was recorded: a joystick")) << text;
  EXPECT_TRUE(contains(
      said(world->bag.imported, {"--only", "ar", "--also", "/estop", "--estop-topic", "/estop"}, 1),
      "it is the emergency stop that this replay obeys"));
}

TEST_F(DefaultDeny, refusesByNameWhatSomebodyPublishesNow) {
  const ros::Publisher laser = world->node.advertise<sensor_msgs::LaserScan>("/base_scan", 1);
  EXPECT_TRUE(contains(
      said(world->bag.imported, {"--only", "ar", "--allow-motion", "--also", "/base_scan"}, 1),
      "/base_scan is published by /test now"));
  ros::Publisher marks =
      world->node.advertise<visualization_msgs::Marker>("/projector/marks", 1, true);
  marks.publish(visualization_msgs::Marker());
  EXPECT_EQ(heard(world->bag.requested, {"--only", "ar,speech"}), kLightAndSpeech)
      << "it could draw there, but it does not";
  const ros::WallTimer drawing = world->node.createWallTimer(
      ros::WallDuration(0.2), [&](const auto&) { marks.publish(visualization_msgs::Marker()); });
  ros::AsyncSpinner spinner(1);
  spinner.start();
  EXPECT_TRUE(contains(said(world->bag.requested, {"--only", "ar"}, 1),
                       "/projector/marks is published by /test now"));
  EXPECT_EQ(heard(world->bag.requested, {"--only", "ar,speech", "--exclude", "/projector/marks"}),
            (Names{"/path", "/projector/points", "/robotsound"}));
}

TEST_F(DefaultDeny, takesADeadNodeForNoPublisher) {
  XmlRpc::XmlRpcValue ghost, answer, payload;
  ghost[0] = "/ghost";
  ghost[1] = "/voice_command";
  ghost[2] = "std_msgs/String";
  ghost[3] = "http://localhost:1";
  ASSERT_TRUE(ros::master::execute("registerPublisher", ghost, answer, payload, false));
  EXPECT_EQ(
      heard(world->bag.imported, {"--only", "ar", "--allow-motion", "--also", "/voice_command"}),
      Names{"/voice_command"});
}

TEST_F(DefaultDeny, isRosbagPlayUnderAPrefixButForMotionAndControlInputs) {
  const Names motion{"/cmd_vel", "/teleop/cmd_vel", "/ackermann_cmd", "/move_base/goal"};
  const Names topics = heard(world->bag.imported, {"--prefix", "/then"}, "/then", motion);
  for (const char* topic : {"/tf", "/joint_states", "/base_scan", "/map", "/imu", "/odom",
                            "/voice_command", "/robotsound", "/path"}) {
    EXPECT_EQ(topics.count(topic), 1u) << topic;
  }
  for (const char* topic : {"/joy", "/initialpose", "/cmd_vel", "/teleop/cmd_vel", "/estop",
                            "/ackermann_cmd", "/move_base/goal", "/motor_power"}) {
    EXPECT_EQ(topics.count(topic), 0u) << topic;
  }
  const ros::Subscriber base = world->node.subscribe("/then/cmd_vel", 1, obey);
  EXPECT_TRUE(contains(said(world->bag.imported, {"--prefix", "/then"}, 1),
                       "motion is not allowed here"))
      << "a robot hears it there: what holds beside a robot holds";
  EXPECT_EQ(heard(world->bag.requested, {"--prefix", "/then", "--only", "ar,speech"}, "/then"),
            kLightAndSpeech);
}

TEST_F(DefaultDeny, knowsThatASlashChangesNoName) {
  EXPECT_TRUE(contains(said(world->bag.imported, {"--prefix", "/", "--exclude", "/cmd_vel"}, 2),
                       "'/' is no topic: a slash is no name"));
}

TEST_F(DefaultDeny, isRosbagPlayWhereNoRobotIsLive) {
  {
    const ros::Publisher joints =
        world->node.advertise<sensor_msgs::JointState>("/joint_states", 1);
    EXPECT_TRUE(contains(said(world->bag.imported, {"--everything"}, 1),
                         "/test sends /joint_states: a robot is live"));
  }
  {
    const ros::Subscriber base = world->node.subscribe<geometry_msgs::Twist>(
        "/other/cmd_vel", 1, +[](const geometry_msgs::TwistConstPtr&) {});
    EXPECT_TRUE(contains(said(world->bag.imported, {"--everything"}, 1),
                         "/test hears /other/cmd_vel: a robot is live"));
  }
  const std::string text =
      said(world->bag.imported, {"--everything", "--remap", "/tf:=/tf_then"}, 0);
  EXPECT_TRUE(contains(text, "/base_scan")) << text;
  EXPECT_TRUE(contains(text, "/joint_states")) << text;
}

TEST_F(DefaultDeny, holdsForThePlayersServicesToo) {
  world->node.setParam("/player_node/also", Texts{"/voice_command"});
  test::NodeProcess player({AFTERGLOW_TEST_PLAYER_NODE, "_store:=" + world->store, "_hold:=0.1",
                            "_allow_motion:=true", "_realtime:=false"});
  ASSERT_TRUE(ros::service::waitForService("/player_node/play", ros::Duration(30)));
  PlayBehavior call;
  call.request.behavior_id = std::stoll(world->bag.imported);
  call.request.only = "ar";
  call.request.also = {"/wheel_left/effort"};
  ASSERT_TRUE(ros::service::call("/player_node/play", call));
  EXPECT_FALSE(call.response.success);
  EXPECT_TRUE(contains(call.response.message, "/wheel_left/effort")) << call.response.message;
  call.request.also.clear();
  std::mutex mutex;
  bool is_heard = false;
  const ros::Subscriber voice = world->node.subscribe<std_msgs::String>(
      "/voice_command", 1, [&](const auto&) {
        const std::lock_guard<std::mutex> lock(mutex);
        is_heard = true;
      });
  ros::AsyncSpinner spinner(1);
  spinner.start();
  ASSERT_TRUE(ros::service::call("/player_node/play", call));
  EXPECT_TRUE(call.response.success) << call.response.message;
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return is_heard;
  })) << "a parameter names it";
}

std::string answerOf(const Texts& player_options, const std::vector<std::string>& also) {
  Texts words{AFTERGLOW_TEST_PLAYER_NODE, "_store:=" + DefaultDeny::world->store, "_hold:=0.1",
              "_realtime:=false"};
  words.insert(words.end(), player_options.begin(), player_options.end());
  test::NodeProcess player(words);
  if (!ros::service::waitForService("/player_node/play", ros::Duration(30))) return "no player";
  PlayBehavior call;
  call.request.behavior_id = std::stoll(DefaultDeny::world->bag.imported);
  call.request.only = "ar";
  call.request.also = also;
  EXPECT_TRUE(ros::service::call("/player_node/play", call));
  EXPECT_FALSE(call.response.success);
  return call.response.message;
}

TEST_F(DefaultDeny, asksTheOwnerForAllButLightAndSpeech) {
  world->node.deleteParam("/player_node/also");
  world->node.deleteParam("/player_node/allow_motion");
  const std::string answer = answerOf({}, {"/joy", "/initialpose", "/voice_command"});
  EXPECT_TRUE(contains(answer, "motion is not allowed here")) << answer;
  for (const char* topic : {"/joy (", "/initialpose (", "/voice_command ("}) {
    EXPECT_TRUE(contains(answer, topic)) << answer;
  }
}

TEST_F(DefaultDeny, looksAtTheNamesThatRosWillPublish) {
  world->node.deleteParam("/player_node/also");
  EXPECT_TRUE(contains(answerOf({"_allow_motion:=true", "_estop_topic:=/halted",
                                 "/voice_command:=/halted"},
                                {"/voice_command"}),
                       "it is the emergency stop that this replay obeys"));
  EXPECT_TRUE(contains(answerOf({"_allow_motion:=true", "_estop_topic:=/halted",
                                 "/halted:=/voice_command"},
                                {"/voice_command"}),
                       "it is the emergency stop that this replay obeys"));
  world->node.deleteParam("/player_node/estop_topic");
  world->node.deleteParam("/player_node/allow_motion");
}

}  // namespace
}  // namespace afterglow::nodes::default_deny_ros_test
