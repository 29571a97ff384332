// What a dry run says would be refused: with a master it asks the robot, without one it says what
// it does not know.
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <std_msgs/Bool.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nodes/tools/ros_graph.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_bytes.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::dry_run_ros_test {
namespace {

using Texts = std::vector<std::string>;

constexpr std::int64_t kBegin = 1'600'000'000'000'000'000;

/// A drive of half a second without poses.
void addDrive(const std::string& path) {
  const auto store = replay::openStore(path, replay::OpenMode::ReadWrite);
  const std::int64_t recording = store->addRecording({0, "", "by hand", ""});
  geometry_msgs::Twist twist;
  twist.linear.x = 0.2;
  replay::Message message;
  const replay::Channel velocities = test::rosChannel<geometry_msgs::Twist>("/cmd_vel");
  message.channel = store->addChannel(recording, velocities);
  message.bytes = test::rosBytes(twist);
  for (std::uint64_t i = 0; i < 5; ++i) {
    message.received = {kBegin + 100'000'000 * static_cast<std::int64_t>(i)};
    message.sequence = i + 1;
    store->append({message});
  }
  replay::Behavior behavior;
  behavior.recording = recording;
  behavior.name = "drive";
  behavior.begin = {kBegin};
  behavior.end = replay::Stamp{kBegin + 500'000'000};
  behavior.topics = {"/cmd_vel"};
  store->addBehavior(behavior);
}

struct DryRun : testing::Test {
  static void SetUpTestSuite() {
    graph = new test::TestGraph;
    folder = new test::TempFolder;
    addDrive(store());
  }
  static void TearDownTestSuite() {
    delete folder;
    delete graph;
    ros::shutdown();
  }
  static std::string store() { return folder->path("behaviors.db"); }
  static std::string said(const Texts& options) {
    Texts words{AFTERGLOW_TEST_COMMAND, "play", "1", "--store", store(), "--dry-run"};
    words.insert(words.end(), options.begin(), options.end());
    test::NodeProcess process(words);
    EXPECT_EQ(process.exitStatus(), 0) << process.log();
    return process.log();
  }
  static void expectSaid(const std::string& text, const Texts& parts) {
    for (const std::string& part : parts) {
      EXPECT_NE(text.find(part), std::string::npos) << "no '" << part << "' in\n" << text;
    }
  }
  static test::TestGraph* graph;
  static test::TempFolder* folder;
};
test::TestGraph* DryRun::graph = nullptr;
test::TempFolder* DryRun::folder = nullptr;

TEST_F(DryRun, tellsAllThatTheRobotWouldBeRefusedFor) {
  const std::string text = said({"--estop-topic", "/estop"});
  expectSaid(text, {"would be refused: motion is not allowed here (~allow_motion, --allow-motion)",
                    "would be refused: the base cannot follow its recorded poses: ",
                    "would be refused: nothing sees what stands in the base's way: --scan TOPIC",
                    "would be refused: nobody listens on /cmd_vel",
                    "would be refused: nobody publishes the emergency stop /estop"});
  EXPECT_TRUE(askMaster(deadlineIn(kMasterPatience)).otherPublishers("/cmd_vel").empty());
}

TEST_F(DryRun, isSilentOfWhatTheRobotHas) {
  ros::NodeHandle node;
  std::atomic<int> sent{0};
  const ros::Subscriber base = node.subscribe<geometry_msgs::Twist>(
      "/cmd_vel", 1, [&sent](const geometry_msgs::TwistConstPtr&) { ++sent; });
  ros::Publisher stop = node.advertise<std_msgs::Bool>("/estop", 1, true);
  stop.publish(std_msgs::Bool());
  ros::AsyncSpinner spinner(1);
  spinner.start();
  const std::string text = said({"--allow-motion", "--open-loop", "--no-scan", "--any-start",
                                 "--estop-topic", "/estop"});
  EXPECT_EQ(text.find("would be refused"), std::string::npos) << text;
  std_msgs::Bool pressed;
  pressed.data = 1;
  stop.publish(pressed);
  expectSaid(said({"--allow-motion", "--open-loop", "--no-scan", "--any-start", "--estop-topic",
                   "/estop", "--json"}),
             {"\"refusals\": [", "the emergency stop is pressed (/estop)"});
  spinner.stop();
  EXPECT_EQ(sent, 0);
}

TEST_F(DryRun, saysWithoutAMasterWhatItDoesNotKnow) {
  const std::string master = getenv("ROS_MASTER_URI");
  setenv("ROS_MASTER_URI", "http://localhost:1", 1);
  const std::string text = said({"--allow-motion", "--estop-topic", "/estop"});
  const std::string json = said({"--allow-motion", "--estop-topic", "/estop", "--json"});
  setenv("ROS_MASTER_URI", master.c_str(), 1);
  expectSaid(text, {"would be refused: the base cannot follow its recorded poses: ",
                    "would be refused: nothing sees what stands in the base's way",
                    "not known, as no ROS master answers: who publishes the same; who hears the "
                    "robot's topics; the emergency stop /estop; where the base is now and what its "
                    "scan sees; whether it stands as it did"});
  const auto plan = nlohmann::json::parse(json.substr(0, json.rfind('}') + 1));
  EXPECT_EQ(plan["refusals"].size(), 2u) << plan;
  EXPECT_EQ(plan["unchecked"].size(), 5u) << plan;
}

}  // namespace
}  // namespace afterglow::nodes::dry_run_ros_test
