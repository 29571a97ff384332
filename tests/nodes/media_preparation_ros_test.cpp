// A replay's light and speech on a running robot: recorded frames in today's tf, sentences told
// ahead.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/ReplayAction.h>
#include <gtest/gtest.h>
#include <sound_play/SoundRequest.h>
#include <std_msgs/String.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>
#include <visualization_msgs/Marker.h>

#include <mutex>
#include <nlohmann/json.hpp>

#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_bytes.hpp"
#include "tests/support/ros_master.hpp"

namespace afterglow::nodes::media_preparation_ros_test {
namespace {

using test::rosBytes;
using test::rosChannel;
using replay::Bytes;
using sound_play::SoundRequest;
using test::eventually;
using visualization_msgs::Marker;

constexpr std::int64_t kBegin = 1'600'000'000'000'000'000, kMs = 1'000'000;

/// A robot that stood at x = 3, with a marker on it, and spoke.
struct MediaPreparationTest : testing::Test {
  template <typename MessageType>
  void record(const std::string& topic, int at_ms, const MessageType& recorded) {
    replay::Message message;
    message.channel = store->addChannel(recording, rosChannel<MessageType>(topic));
    message.received = {kBegin + at_ms * kMs};
    message.sequence = sequence++;
    message.bytes = rosBytes(recorded);
    store->append({message});
  }
  static ros::Time recordedAt(int ms) {
    ros::Time time;
    time.fromNSec(static_cast<std::uint64_t>(kBegin + ms * kMs));
    return time;
  }

  void SetUp() override {
    for (int ms = -100; ms <= 500; ms += 20) {
      tf2_msgs::TFMessage transforms;
      transforms.transforms.resize(1);
      geometry_msgs::TransformStamped& transform = transforms.transforms[0];
      transform.header.frame_id = "map";
      transform.header.stamp = recordedAt(ms);
      transform.child_frame_id = "base_link";
      transform.transform.translation.x = 3;
      transform.transform.rotation.w = 1;
      record("/tf", ms, transforms);
    }
    Marker marker;
    marker.header.frame_id = "base_link";
    marker.header.stamp = recordedAt(90);
    marker.pose.orientation.w = 1;
    record("/marker", 100, marker);
    SoundRequest request;
    request.sound = SoundRequest::SAY;
    request.arg = "Here it was.";
    record("/robotsound", 150, request);
    replay::Behavior behavior;
    behavior.recording = recording;
    behavior.name = "pick";
    behavior.begin = {kBegin};
    behavior.end = replay::Stamp{kBegin + 300 * kMs};
    behavior.topics = {"/marker", "/robotsound"};
    replay::Snapshot snapshot;
    snapshot.requested = behavior.topics;
    behavior.snapshot = snapshot.toJson();
    id = store->addBehavior(behavior);
  }
  /// What player_node reports.
  nlohmann::json replayed() {
    actionlib::SimpleActionClient<ReplayAction> replayer("/player_node/replay", true);
    if (!replayer.waitForServer(ros::Duration(20))) throw std::runtime_error("no player_node");
    ReplayGoal goal;
    goal.behavior = std::to_string(id);
    replayer.sendGoalAndWait(goal, ros::Duration(30));
    EXPECT_EQ(replayer.getState().toString(), "SUCCEEDED") << replayer.getState().getText();
    return nlohmann::json::parse(replayer.getResult()->report);
  }
  void onMarker(const Marker& marker) {
    const std::lock_guard<std::mutex> lock(mutex);
    markers.push_back(marker);
  }
  void onSpeech(const SoundRequest& request) { hear("said " + request.arg); }
  void hear(const std::string& text) {
    const std::lock_guard<std::mutex> lock(mutex);
    heard.push_back(text);
  }
  std::vector<std::string> heardSoFar() {
    const std::lock_guard<std::mutex> lock(mutex);
    return heard;
  }

  test::TempFolder folder;
  std::unique_ptr<replay::Store> store =
      replay::openStore(folder.path("store.db"), replay::OpenMode::ReadWrite);
  std::int64_t recording = store->addRecording({0, "", "test", ""});
  std::uint64_t sequence = 0;
  std::int64_t id = 0;
  test::NodeProcess player{{AFTERGLOW_TEST_PLAYER_NODE, "__name:=player_node",
                            "replay:=/player_node/replay", "_store:=" + folder.path("store.db"),
                            "_hold:=0.1"}};
  ros::NodeHandle node;
  std::mutex mutex;
  std::vector<Marker> markers;
  std::vector<std::string> heard;
  ros::Subscriber marker_subscriber =
      node.subscribe("/marker", 10, &MediaPreparationTest::onMarker, this);
  ros::Subscriber speech_subscriber =
      node.subscribe("/robotsound", 10, &MediaPreparationTest::onSpeech, this);
};

TEST_F(MediaPreparationTest, refusesLightWhereTodaysTfHasNoAnchor) {
  const nlohmann::json report = replayed();
  const nlohmann::json& light = report["topics"]["/marker"];
  EXPECT_EQ(light["refused"], 1) << report.dump(2);
  EXPECT_EQ(light["problem"],
            "today's tf has no frame 'map' (--anchor-frame) for light to stay in place in");
  EXPECT_EQ(report["topics"]["/robotsound"]["published"], 1) << "the rest goes on";
}

TEST_F(MediaPreparationTest, tellsTodaysTfWhereRecordedFramesWereAndTheSpeakerWhatItWillSay) {
  const ros::Subscriber ahead = node.subscribe<SoundRequest>(
      "/robotsound/ahead", 10,
      [this](const sound_play::SoundRequestConstPtr& request) { hear("ahead " + request->arg); });
  ros::Publisher problem = node.advertise<std_msgs::String>("/robotsound/problem", 1, true);
  std_msgs::String text;
  text.data = "no loudspeaker";
  problem.publish(text);
  tf2_ros::Buffer today;
  const tf2_ros::TransformListener listener(today);
  ros::Publisher tf = node.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
  tf2_msgs::TFMessage robot;  // of today, elsewhere
  robot.transforms.resize(1);
  robot.transforms[0].header.frame_id = "map";
  robot.transforms[0].child_frame_id = "base_link";
  robot.transforms[0].transform.rotation.w = 1;
  tf.publish(robot);
  const nlohmann::json report = replayed();
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return !markers.empty();  // more follow: they take it away again
  })) << report.dump(2);
  EXPECT_EQ(markers[0].header.frame_id, "recorded/base_link");
  ASSERT_TRUE(eventually(
      [&] { return today.canTransform("map", "recorded/base_link", markers[0].header.stamp); }));
  EXPECT_DOUBLE_EQ(today.lookupTransform("map", "recorded/base_link", markers[0].header.stamp)
                       .transform.translation.x,
                   3);
  const ros::Time newest =
      today.lookupTransform("map", "recorded/base_link", ros::Time(0)).header.stamp;
  EXPECT_GT(newest, markers[0].header.stamp) << "it is told again as the replay goes on";
  EXPECT_TRUE(eventually([&] { return heardSoFar().size() == 2; }));
  EXPECT_EQ(heardSoFar(), (std::vector<std::string>{"ahead Here it was.", "said Here it was."}));
  EXPECT_NE(report["notes"].dump().find("speech was lost: no loudspeaker"), std::string::npos)
      << report["notes"];
}

}  // namespace
}  // namespace afterglow::nodes::media_preparation_ros_test

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  const afterglow::test::RosMaster master;
  ros::init(argc, argv, "media_preparation_test", ros::init_options::NoSigintHandler);
  ros::NodeHandle node;
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
