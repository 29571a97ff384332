// Recordings as code makes them, with recorder_node in a process of its own.
#include "afterglow/behavior_recording.hpp"

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <std_msgs/String.h>

#include <chrono>

#include "afterglow/tree_watch.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::behavior_recording_ros_test {
namespace {

using test::eventually;

/// A master, this process on its graph, a recorder.
struct Robot {
  Robot() {
    int argc = 0;
    ros::init(argc, nullptr, "test", ros::init_options::NoSigintHandler);
    node = std::make_unique<ros::NodeHandle>();
    recorder = std::make_unique<test::NodeProcess>(
        std::vector<std::string>{AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + store_path});
  }
  ~Robot() {
    recorder.reset();
    node.reset();
    ros::shutdown();
  }

  test::TempFolder folder;
  std::string store_path = folder.path("behaviors.db");
  test::RosMaster master;
  std::unique_ptr<ros::NodeHandle> node;
  std::unique_ptr<test::NodeProcess> recorder;
};

RecordingOptions optionsOf(const std::string& name, double timeout_s = 30.0) {
  RecordingOptions options;
  options.name = name;
  options.topics = {"/said"};
  options.timeout_s = timeout_s;
  return options;
}

void say(const ros::Publisher& publisher, const std::string& text) {
  std_msgs::String message;
  message.data = text;
  publisher.publish(message);
}

TEST(BehaviorRecording, isWhatTheStoreHoldsAndNeverHangs) {
  Robot robot;
  const ros::Publisher publisher = robot.node->advertise<std_msgs::String>("/said", 10);
  {
    BehaviorRecording kitting(optionsOf("kitting"));
    ASSERT_EQ(kitting.problem(), "");
    const EnclosingRecording enclosing(kitting);
    RecordingOptions options = optionsOf("pick");
    options.parameters = R"({"object": "gearbox bottom"})";
    options.tags = {"demo"};
    options.attempt = 2;
    BehaviorRecording pick(options);
    ASSERT_EQ(pick.problem(), "");
    say(publisher, "here");  // at once: the recording stands
    pick.fail();
  }
  {
    // What the recorder refuses is said, and nobody is stopped by it.
    RecordingOptions options = optionsOf("nothing");
    options.topics = {"said"};
    EXPECT_NE(BehaviorRecording(options).problem(), "");
  }
  EXPECT_EQ(BehaviorRecording(optionsOf("elsewhere", 0.1), rosRecorder("/nobody")).id(), 0);

  const auto store = replay::openStore(robot.store_path, replay::OpenMode::ReadOnly);
  const std::vector<replay::Behavior> behaviors = store->behaviors({});
  ASSERT_EQ(behaviors.size(), 2U);
  const replay::Behavior& pick = behaviors[0];
  EXPECT_EQ(pick.name + " " + pick.tree_path + " " + pick.outcome, "pick kitting/pick failure");
  EXPECT_EQ(pick.parent, behaviors[1].id);
  EXPECT_EQ(pick.attempt, 2);
  EXPECT_EQ(pick.tags, std::vector<std::string>{"demo"});
  EXPECT_NE(pick.parameters.find("gearbox bottom"), std::string::npos);
  EXPECT_EQ(behaviors[1].outcome, "stopped");
  const auto topics = store->topics(pick);
  ASSERT_EQ(topics.size(), 1U);
  EXPECT_EQ(topics[0].count, 1U);

  // What a tree does is published on a topic of this node.
  std::vector<TreeTransition> heard;
  const ros::Subscriber ear = robot.node->subscribe<TreeTransition>(
      "/test/tree_transitions", 10,
      [&heard](const TreeTransition::ConstPtr& transition) { heard.push_back(*transition); });
  TreeWatch watch({{"kitting", "Sequence", 7, {}}}, {});
  EXPECT_TRUE(eventually([&] {
    watch.onTransition(0, "IDLE", "RUNNING");
    ros::spinOnce();
    return !heard.empty();
  }));
  EXPECT_EQ(heard.at(0).path + " " + heard.at(0).to_status, "kitting RUNNING");
  EXPECT_FALSE(heard.at(0).stamp.isZero());

  // A recorder that hangs costs a timeout, once.
  robot.recorder->signal(SIGSTOP);
  const auto begin = std::chrono::steady_clock::now();
  for (const char* name : {"a", "b", "c"}) {
    BehaviorRecording recording(optionsOf(name, 0.2));
    EXPECT_NE(recording.problem(), "");
    recording.succeed();
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
  robot.recorder->signal(SIGCONT);
}

}  // namespace
}  // namespace afterglow::nodes::behavior_recording_ros_test
