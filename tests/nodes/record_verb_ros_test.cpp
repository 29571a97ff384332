// `afterglow record`, as a user meets it: alone and by a recorder_node, until Ctrl-C and with a
// command.
#include <gtest/gtest.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <regex>
#include <string>
#include <vector>

#include "replay/bags/bag_file.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::record_verb_ros_test {
namespace {

using Words = std::vector<std::string>;

class RecordVerb : public testing::Test {
 protected:
  RecordVerb() {
    static test::TestGraph graph;
    static const ros::NodeHandle stays;  // with the last handle ROS shuts down
    node_ = std::make_unique<ros::NodeHandle>();
    chat_ = node_->advertise<std_msgs::String>("/chat", 10, true);
    std_msgs::String hello;
    hello.data = "hello";
    chat_.publish(hello);
    spinner_ = std::make_unique<ros::AsyncSpinner>(1);
    spinner_->start();
  }

  test::NodeProcess record(const Words& words) {
    Words all = {AFTERGLOW_TEST_COMMAND, "record"};
    all.insert(all.end(), words.begin(), words.end());
    return test::NodeProcess(all);
  }
  /// Of behavior 1.
  replay::Behavior recorded() {
    const auto store = replay::openStore(path_, replay::OpenMode::ReadOnly);
    const auto behavior = store->behavior(1);
    EXPECT_TRUE(behavior);
    if (!behavior) return {};
    EXPECT_EQ(test::readTexts(*store, *behavior), Words{"hello"});
    return *behavior;
  }
  static bool says(const test::NodeProcess& process, const std::string& text) {
    return test::eventually([&] { return process.log().find(text) != std::string::npos; });
  }

  test::TempFolder folder_;
  std::string path_ = folder_.path("store.db");
  std::unique_ptr<ros::NodeHandle> node_;
  ros::Publisher chat_;
  std::unique_ptr<ros::AsyncSpinner> spinner_;  ///< made when ROS is there
};

TEST_F(RecordVerb, endsWithOneInterruptOrMore) {
  auto verb = record({"--name", "talk", "--store", path_, "--outcome", "done", "chat"});
  EXPECT_TRUE(says(verb, "Ctrl-C ends it")) << verb.log();
  verb.interrupt();
  verb.interrupt();
  EXPECT_EQ(verb.exitStatus(), 0) << verb.log();
  EXPECT_NE(verb.log().find("afterglow show 1 --store "), std::string::npos) << verb.log();
  EXPECT_EQ(recorded().name, "talk");
  EXPECT_EQ(recorded().outcome, "done");
  EXPECT_TRUE(recorded().end);
}

TEST_F(RecordVerb, takesACommandForTheBehavior) {
  auto verb = record({"--name", "talk", "--store", path_, "-e", "/ch.*", "--", "sh", "-c",
                      "echo running; exit 3"});
  EXPECT_EQ(verb.exitStatus(), 1);
  EXPECT_NE(verb.log().find("running"), std::string::npos) << verb.log();
  EXPECT_NE(verb.log().find("the command ended with status 3"), std::string::npos) << verb.log();
  EXPECT_EQ(recorded().outcome, "failure");
}

TEST_F(RecordVerb, recordsNothingWhereTheCommandIsMisspelled) {
  for (const std::string program : {"no_such_program", "/no/such/program"}) {
    auto verb = record({"--name", "talk", "--store", path_, "/chat", "--", program});
    EXPECT_EQ(verb.exitStatus(), 1);
    EXPECT_NE(verb.log().find("cannot start " + program + ": there is no such program"),
              std::string::npos)
        << verb.log();
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(RecordVerb, asksARecorderThatRuns) {
  test::NodeProcess recorder({AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + path_});
  ASSERT_TRUE(test::eventually(
      [] { return ros::service::exists("/recorder_node/start_recording", false); }));
  auto verb = record({"--name", "talk", "/chat", "--", "true"});
  EXPECT_EQ(verb.exitStatus(), 0) << verb.log();
  EXPECT_NE(verb.log().find("by /recorder_node"), std::string::npos) << verb.log();
  EXPECT_EQ(recorded().outcome, "success");
}

TEST_F(RecordVerb, tellsOfEachNamedTopicWhatCameOnIt) {
  test::NodeProcess recorder({AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + path_});
  ASSERT_TRUE(test::eventually(
      [] { return ros::service::exists("/recorder_node/start_recording", false); }));
  auto verb = record({"--name", "talk", "/chat", "/silent"});
  EXPECT_TRUE(says(verb, "  /chat: 1 messages, ")) << verb.log();
  EXPECT_TRUE(says(verb, "  /silent: nothing yet\n")) << verb.log();
  verb.interrupt();
  EXPECT_EQ(verb.exitStatus(), 0) << verb.log();
  EXPECT_NE(verb.log().find("afterglow record: nothing on /silent\n"), std::string::npos)
      << verb.log();
  EXPECT_NE(verb.log().find("behavior 1: 1 messages, 0 lost"), std::string::npos) << verb.log();
  EXPECT_EQ(recorded().outcome, "stopped");
}

TEST_F(RecordVerb, refusesWhatCannotBeRecorded) {
  auto nothing = record({"--name", "talk", "--store", path_});
  EXPECT_EQ(nothing.exitStatus(), 1);
  EXPECT_NE(nothing.log().find("no topics are named"), std::string::npos) << nothing.log();
}

TEST_F(RecordVerb, writesAFileAndNamesTheBehaviorAfterItAsRosbagRecordDoes) {
  auto verb = record({"-O", folder_.path("talk.mcap"), "--store", path_, "/chat", "--", "true"});
  EXPECT_EQ(verb.exitStatus(), 0) << verb.log();
  EXPECT_EQ(recorded().name, "talk");
  EXPECT_NE(verb.log().find("talk.mcap: 1 message, "), std::string::npos) << verb.log();
  EXPECT_EQ(replay::summarizeBag(folder_.path("talk.mcap")).messages, 1u);

  auto interrupted = record({"-O", folder_.path("again"), "--store", path_, "/chat"});
  EXPECT_TRUE(says(interrupted, "Ctrl-C ends it")) << interrupted.log();
  interrupted.interrupt();
  EXPECT_EQ(interrupted.exitStatus(), 0) << interrupted.log();
  EXPECT_EQ(replay::summarizeBag(folder_.path("again.bag")).messages, 1u);
}

TEST_F(RecordVerb, namesFileAndBehaviorByPrefixAndTime) {
  auto verb = record({"-o", folder_.path("talk"), "--store", path_, "/chat", "--", "true"});
  EXPECT_EQ(verb.exitStatus(), 0) << verb.log();
  EXPECT_EQ(recorded().name, "talk");
  const std::regex name(R"(.*/talk_\d{4}-\d\d-\d\d-\d\d-\d\d-\d\d\.bag)");
  const std::filesystem::directory_iterator files(std::filesystem::path(path_).parent_path());
  EXPECT_EQ(
      std::count_if(begin(files), end(files),
                    [&](const auto& file) { return std::regex_match(file.path().string(), name); }),
      1);
}

TEST_F(RecordVerb, namesABehaviorByItsTimeWhereNothingElseNamesIt) {
  auto verb = record({"--store", path_, "/chat", "--", "true"});
  EXPECT_EQ(verb.exitStatus(), 0) << verb.log();
  EXPECT_TRUE(std::regex_match(recorded().name, std::regex(R"([-\d]{19})"))) << recorded().name;
}

}  // namespace
}  // namespace afterglow::nodes::record_verb_ros_test
