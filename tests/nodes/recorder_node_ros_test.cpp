// recorder_node as a process of its own: which topics it takes and when, what it keeps beside the
// messages, and what is left when it dies.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <mongodb/MongoDBLoggerAction.h>
#include <sensor_msgs/CameraInfo.h>
#include <sound_play/SoundRequest.h>
#include <std_msgs/String.h>
#include <std_msgs/UInt64.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/checksum.hpp"
#include "replay/store/store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::recorder_node_ros_test {
namespace {

using test::eventually;
using Texts = std::vector<std::string>;
const ros::Duration kPatience(30);

std_msgs::String say(const std::string& text) {
  std_msgs::String message;
  message.data = text;
  return message;
}

struct World {
  World() {
    test::writeFile(folder.path("projector.yaml"), "fx: 1000\n");
    test::writeFile(folder.path("hello.wav"), "RIFF");
    ros::param::set("/recorder_node/pre_roll_topics", Texts{"/heartbeat"});
    ros::param::set("/recorder_node/anchors", Texts{"map", "odom", "nowhere", "base_link"});
    ros::param::set("/recorder_node/file_roots", Texts{folder.path("")});
    ros::param::set("/robot_description", "<robot name='fetch'/>");
    node = std::make_unique<ros::NodeHandle>();
    spinner.start();
    recorder = startRecorder("recorder_node", store);
  }
  ~World() { spinner.stop(); }

  std::unique_ptr<test::NodeProcess> startRecorder(const std::string& name, const std::string& path,
                                                   const std::string& more = "_min_space:=0") {
    return std::make_unique<test::NodeProcess>(
        Texts{AFTERGLOW_TEST_RECORDER_NODE, "__name:=" + name, "_store:=" + path, more,
              "_calibration:=" + folder.path(""), "_rescan:=0.05",
              "record_behavior:=/" + name + "/record_behavior"});
  }

  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  test::TestGraph graph;
  std::unique_ptr<ros::NodeHandle> node;
  ros::AsyncSpinner spinner{2};
  std::unique_ptr<test::NodeProcess> recorder;
};

class RecorderNodeTest : public testing::Test {
 public:
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() {
    delete world;
    ros::shutdown();
  }

  template <typename Message = std_msgs::String>
  static ros::Publisher advertise(const std::string& topic, bool latches = false) {
    return world->node->advertise<Message>(topic, 1000, latches);
  }
  /// Once the recorder is there to hear it.
  template <typename Message>
  static void publish(const ros::Publisher& publisher, const Message& message) {
    ASSERT_TRUE(eventually([&] { return publisher.getNumSubscribers() > 0; }));
    publisher.publish(message);
  }
  static StartRecording::Request request(const Texts& topics) {
    StartRecording::Request asked;
    asked.name = "pick";
    asked.topics = topics;
    return asked;
  }
  static StartRecording::Response start(const StartRecording::Request& asked,
                                        const std::string& recorder = "recorder_node") {
    StartRecording::Response response;
    const std::string service = "/" + recorder + "/start_recording";
    EXPECT_TRUE(ros::service::waitForService(service, kPatience));
    EXPECT_TRUE(ros::service::call(service, asked, response));
    return response;
  }
  static StopRecording::Response stop(std::int64_t id, const std::string& outcome = "success",
                                      const std::string& recorder = "recorder_node") {
    StopRecording::Request asked;
    StopRecording::Response response;
    asked.behavior_id = id;
    asked.outcome = outcome;
    EXPECT_TRUE(ros::service::call("/" + recorder + "/stop_recording", asked, response));
    EXPECT_TRUE(response.success) << response.message;
    return response;
  }
  static std::unique_ptr<replay::Store> openStore(const std::string& path = world->store) {
    return replay::openStore(path, replay::OpenMode::ReadOnly);
  }
  static replay::Behavior stored(std::int64_t id) { return openStore()->behavior(id).value(); }
  static Texts texts(std::int64_t id) {
    const auto store = openStore();
    return test::readTexts(*store, store->behavior(id).value());
  }

  static World* world;
};
World* RecorderNodeTest::world = nullptr;

TEST_F(RecorderNodeTest, takesTopicsByPatternAlsoLateOnes) {
  const ros::Publisher early = advertise("/camera/early"), raw = advertise("/camera/early/raw"),
                       other = advertise("/other");
  StartRecording::Request asked = request({});
  asked.regexes = {"/camera/.*"};
  asked.exclude = {".*/raw"};
  const auto started = start(asked);
  ASSERT_TRUE(started.success) << started.message;
  EXPECT_EQ(early.getNumSubscribers(), 1u) << "confirmed before the start returned";
  early.publish(say("early"));
  raw.publish(say("excluded"));
  other.publish(say("other"));
  const ros::Publisher late = advertise("/camera/late");
  publish(late, say("late"));
  const auto stopped = stop(started.behavior_id);
  EXPECT_EQ(stopped.messages, 2u);
  EXPECT_TRUE(stopped.kept);
  EXPECT_EQ(stored(started.behavior_id).topics, (Texts{"/camera/early", "/camera/late"}));
  EXPECT_EQ(texts(started.behavior_id), (Texts{"early", "late"}));
  EXPECT_EQ(replay::requestedTopics(stored(started.behavior_id)), Texts()) << "named one by one";
}

TEST_F(RecorderNodeTest, takesAllButItsOwnAndTheLogs) {
  const ros::Publisher one = advertise("/one");
  StartRecording::Request asked = request({});
  asked.all = true;
  const auto started = start(asked);
  one.publish(say("1"));
  stop(started.behavior_id);
  const Texts topics = stored(started.behavior_id).topics;
  const auto has = [&](const std::string& topic) {
    return std::find(topics.begin(), topics.end(), topic) != topics.end();
  };
  EXPECT_TRUE(has("/one"));
  EXPECT_FALSE(has("/rosout"));
  EXPECT_FALSE(has("/rosout_agg"));
  EXPECT_EQ(texts(started.behavior_id), Texts{"1"});
  EXPECT_EQ(replay::requestedTopics(stored(started.behavior_id)), Texts());
}

TEST_F(RecorderNodeTest, hearsTheFirstMessageOfEveryAttempt) {
  const ros::Publisher topic = advertise("/retried");
  for (int attempt = 1; attempt <= 5; ++attempt) {
    StartRecording::Request asked = request({"/retried"});
    asked.tree_path = "kitting/pick";
    const auto started = start(asked);
    topic.publish(say("at once"));
    stop(started.behavior_id, "failure");
    EXPECT_EQ(texts(started.behavior_id), Texts{"at once"});
    EXPECT_EQ(stored(started.behavior_id).attempt, attempt);
  }
}

TEST_F(RecorderNodeTest, outlivesAPublisherAndItsType) {
  const auto started = start(request({"/changing"}));
  {
    const ros::Publisher text = advertise("/changing");
    publish(text, say("text"));
    ASSERT_TRUE(eventually([&] { return texts(started.behavior_id).size() == 1; }));
  }
  const ros::Publisher number = advertise<std_msgs::UInt64>("/changing");
  publish(number, std_msgs::UInt64());
  EXPECT_EQ(stop(started.behavior_id).messages, 2u);
  const auto store = openStore();
  const auto summaries = store->topics(store->behavior(started.behavior_id).value());
  ASSERT_EQ(summaries.size(), 2u);
  EXPECT_EQ(summaries[0].type, "std_msgs/String");
  EXPECT_EQ(summaries[1].type, "std_msgs/UInt64");
}

TEST_F(RecorderNodeTest, reachesBackOnTopicsItListensToAlways) {
  const ros::Publisher heartbeat = advertise("/heartbeat");
  publish(heartbeat, say("before the start"));
  StartRecording::Request asked = request({"/heartbeat"});
  asked.pre_roll = 9;
  // The message may still be on its way.
  std::int64_t id = 0;
  ASSERT_TRUE(eventually([&] {
    id = start(asked).behavior_id;
    stop(id);
    return !texts(id).empty();
  }));
  EXPECT_EQ(texts(id), Texts{"before the start"});
}

TEST_F(RecorderNodeTest, thinsOutAndKeepsOnlyWhatItIsToldTo) {
  const ros::Publisher scan = advertise("/scan");
  StartRecording::Request asked = request({"/scan"});
  asked.limits = {"/scan every=5"};
  asked.keep_if = "failure, aborted";
  for (const std::string outcome : {"success", "failure"}) {
    const auto started = start(asked);
    ASSERT_TRUE(started.success) << started.message;
    for (int i = 0; i < 10; ++i) scan.publish(say(std::to_string(i)));
    const auto stopped = stop(started.behavior_id, outcome);
    EXPECT_EQ(stopped.remarks, Texts{"8 messages on /scan were left out of 10, as asked: every=5"});
    EXPECT_EQ(stopped.kept, outcome == "failure");
    EXPECT_EQ(stopped.messages, outcome == "failure" ? 2u : 0u);
    EXPECT_EQ(openStore()->behavior(started.behavior_id).has_value(), outcome == "failure");
  }
  asked.limits = {"/scan sometimes"};
  EXPECT_EQ(start(asked).message.rfind("limit '/scan sometimes' is not of the form", 0), 0u);
  asked.limits.clear();
  asked.regexes = {"/("};
  EXPECT_EQ(start(asked).message.rfind("'/(' is no regular expression", 0), 0u);
}

TEST_F(RecorderNodeTest, keepsWhatReplayNeedsOfTheWorld) {
  const ros::Publisher tf = advertise<tf2_msgs::TFMessage>("/tf"),
                       sound = advertise<sound_play::SoundRequest>("/robotsound"),
                       camera = advertise<sensor_msgs::CameraInfo>("/projector/camera_info", true);
  sensor_msgs::CameraInfo info;
  info.width = 1280;
  camera.publish(info);
  tf2_msgs::TFMessage moved;
  moved.transforms.resize(1);
  moved.transforms[0].header.frame_id = "map";
  moved.transforms[0].child_frame_id = "odom";
  moved.transforms[0].transform.rotation.w = 1;
  const std::string file = "file://" + world->folder.path("hello.wav");
  const std::string linked = world->folder.path("private.wav");
  std::filesystem::create_symlink("/etc/passwd", linked);
  sound_play::SoundRequest request_to_play;
  request_to_play.sound = sound_play::SoundRequest::PLAY_FILE;
  nlohmann::json snapshot, calibration;
  replay::Behavior behavior;
  ASSERT_TRUE(eventually([&] {  // transforms and camera_info may be on their way
    moved.transforms[0].header.stamp = ros::Time::now();
    moved.transforms[0].transform.translation.x = 2;
    publish(tf, moved);
    const auto started = start(request({"/robotsound"}));
    request_to_play.arg = world->folder.path("hello.wav");
    publish(sound, request_to_play);
    for (const std::string& other : {std::string("/etc/passwd"), linked}) {
      request_to_play.arg = other;
      publish(sound, request_to_play);
    }
    stop(started.behavior_id);
    behavior = stored(started.behavior_id);
    snapshot = nlohmann::json::parse(behavior.snapshot);
    calibration = nlohmann::json::parse(behavior.calibration);
    return snapshot.contains("frames") && snapshot["frames"].contains("begin") &&
           calibration.contains("camera_info");
  }));
  const nlohmann::json pose = {{"map->odom", {2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0}}};
  EXPECT_EQ(snapshot["frames"]["begin"], pose) << "other anchors are not connected";
  EXPECT_EQ(snapshot["frames"]["end"], pose);
  EXPECT_EQ(calibration["projector.yaml"], "fx: 1000\n");
  EXPECT_EQ(calibration["camera_info"]["width"], 1280);
  EXPECT_EQ(snapshot["request"], nlohmann::json({{"topics", {"/robotsound"}}}));
  const replay::Bytes sound_bytes = {'R', 'I', 'F', 'F'};
  EXPECT_EQ(snapshot["files"], nlohmann::json({{file, replay::sha256(sound_bytes)}}));
  EXPECT_EQ(openStore()->file(replay::sha256(sound_bytes)), sound_bytes);
  const auto urdf = openStore()->file(snapshot["urdf"]);
  ASSERT_TRUE(urdf);
  EXPECT_EQ(std::string(urdf->begin(), urdf->end()), "<robot name='fetch'/>");
  const auto refusal = [](const std::string& uri, const std::string& why) {
    return "the file 'file://" + uri + "' was not kept: " + why;
  };
  EXPECT_EQ(behavior.remarks,
            (Texts{refusal("/etc/passwd", "no sound and no mesh by its name"),
                   refusal(linked, "a link to what is no sound and no mesh")}));
  EXPECT_NEAR(static_cast<double>(behavior.wall_begin.ns - behavior.begin.ns), 0, 1e9);
}

TEST_F(RecorderNodeTest, notesWhoPublishedAndWhoHeard) {
  const ros::Publisher words = advertise("/noted/words"), silent = advertise("/noted/silent"),
                       elsewhere = advertise<geometry_msgs::Twist>("/driven_elsewhere");
  const ros::Subscriber ear = world->node->subscribe<std_msgs::String>(
      "/noted/words", 1, +[](const std_msgs::StringConstPtr&) {});
  const auto started = start(request({"/noted/words", "/noted/silent"}));
  ASSERT_TRUE(started.success) << started.message;
  publish(words, say("hello"));
  stop(started.behavior_id);
  const replay::RecordedNodes nodes = replay::recordedNodes(stored(started.behavior_id));
  const std::set<std::string> here{ros::this_node::getName()};
  ASSERT_EQ(nodes.count("/noted/words"), 1u);
  EXPECT_EQ(nodes.at("/noted/words").type, "std_msgs/String");
  EXPECT_EQ(nodes.at("/noted/words").publishers, here);
  EXPECT_EQ(nodes.at("/noted/words").subscribers, here) << "without the recorder";
  ASSERT_EQ(nodes.count("/noted/silent"), 1u);
  EXPECT_EQ(nodes.at("/noted/silent").publishers, here) << "announced";
  ASSERT_EQ(nodes.count("/driven_elsewhere"), 1u) << "it tells who drove";
  EXPECT_EQ(nodes.at("/driven_elsewhere").type, "geometry_msgs/Twist");
}

TEST_F(RecorderNodeTest, servesThePapersLogger) {
  const ros::Publisher heard = advertise("/heard");
  actionlib::SimpleActionClient<mongodb::MongoDBLoggerAction> client("/mongodb_logger", false);
  ASSERT_TRUE(client.waitForServer(kPatience));
  mongodb::MongoDBLoggerGoal goal;
  goal.topics.data = "/heard:/silent";
  std::atomic<bool> is_ready{false};
  client.sendGoal(goal, {}, {}, [&](const auto&) { is_ready = true; });
  ASSERT_TRUE(eventually([&] { return is_ready.load(); }));
  EXPECT_EQ(heard.getNumSubscribers(), 1u);
  heard.publish(say("logged"));
  client.cancelGoal();
  ASSERT_TRUE(client.waitForResult(kPatience));
  EXPECT_EQ(client.getState(), actionlib::SimpleClientGoalState::PREEMPTED);
  EXPECT_EQ(client.getResult()->topics_logged.data, "/heard");
  replay::BehaviorFilter named;
  named.name = "mongodb_logger";
  const auto behaviors = openStore()->behaviors(named);
  ASSERT_EQ(behaviors.size(), 1u);
  EXPECT_EQ(texts(behaviors[0].id), Texts{"logged"});
  client.sendGoal({});
  ASSERT_TRUE(client.waitForResult(kPatience));
  EXPECT_EQ(client.getState(), actionlib::SimpleClientGoalState::REJECTED);
}

TEST_F(RecorderNodeTest, tellsHowItFares) {
  std::atomic<bool> is_fine{false};
  const ros::Subscriber subscriber = world->node->subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 10, [&](const diagnostic_msgs::DiagnosticArrayConstPtr& array) {
        for (const auto& status : array->status) {
          if (status.name == "recorder_node: recorder" && status.level == status.OK) is_fine = true;
        }
      });
  EXPECT_TRUE(eventually([&] { return is_fine.load(); }));
}

TEST_F(RecorderNodeTest, recordsNothingOnAFullDisk) {
  // More than any disk has.
  const auto full =
      world->startRecorder("full", world->folder.path("full.db"), "_min_space:=2000000000");
  const auto refused = start(request({"/a"}), "full");
  EXPECT_FALSE(refused.success);
  EXPECT_NE(refused.message.find("MiB that recording wants; make room, or set another ~min_space "
                                 "or ~store"),
            std::string::npos)
      << refused.message;
}

TEST_F(RecorderNodeTest, leavesWhatItHadWhenItIsKilledAndMarksItNextTime) {
  const std::string path = world->folder.path("fragile.db");
  const ros::Publisher topic = advertise("/fragile_topic");
  std::int64_t id = 0;
  {
    const auto recorder = world->startRecorder("fragile", path);
    id = start(request({"/fragile_topic"}), "fragile").behavior_id;
    topic.publish(say("kept"));
    ASSERT_TRUE(eventually([&] {
      const auto store = openStore(path);
      return test::readTexts(*store, store->behavior(id).value()).size() == 1;
    }));
    test::NodeProcess second({AFTERGLOW_TEST_RECORDER_NODE, "__name:=second", "_store:=" + path});
    EXPECT_EQ(second.exitStatus(), 1) << "one recorder a store";
    EXPECT_NE(second.log().find(path), std::string::npos) << second.log();
  }  // kill -9
  const auto recorder = world->startRecorder("fragile", path);
  stop(start(request({"/fragile_topic"}), "fragile").behavior_id, "success", "fragile");
  const auto store = openStore(path);
  const replay::Behavior behavior = store->behavior(id).value();
  EXPECT_EQ(behavior.outcome, replay::kIncomplete);
  EXPECT_TRUE(behavior.end);
  EXPECT_EQ(test::readTexts(*store, behavior), Texts{"kept"});
}

/// Before the last: the other tests' connections do not know the new master.
TEST_F(RecorderNodeTest, zzGoesOnWithAMasterThatIsStartedAnew) {
  const ros::Publisher topic = advertise("/before_it_died");
  const std::int64_t id = start(request({"/before_it_died", "/after_it_died"})).behavior_id;
  publish(topic, say("one"));
  world->graph.master.end();
  publish(topic, say("two"));
  world->graph.master.start();
  const ros::Publisher late = advertise("/after_it_died");
  publish(late, say("three"));
  EXPECT_TRUE(ros::service::waitForService("/recorder_node/stop_recording", kPatience));
  stop(id);
  const Texts kept = texts(id);
  EXPECT_EQ(std::set<std::string>(kept.begin(), kept.end()),
            (std::set<std::string>{"one", "two", "three"}));
}

/// The last: nobody finds anybody any more.
TEST_F(RecorderNodeTest, zzzEndsThoughMasterAndPublisherAreGone) {
  ros::param::set("/second/pre_roll_topics", Texts{"/before_it_ends"});
  const auto second = world->startRecorder("second", world->folder.path("second.db"));
  std::atomic<int> told{0};
  const ros::Subscriber diagnostics = world->node->subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 10, [&](const auto& array) {
        if (array->status.at(0).name.find("second") == 0) ++told;
      });
  ros::Publisher topic = advertise("/before_it_ends");
  publish(topic, say("one"));
  EXPECT_TRUE(eventually([&] { return told > 1; }));
  world->graph.master.end();
  topic.shutdown();
  told = 0;
  EXPECT_TRUE(eventually([&] { return told > 2; }));
  second->signal(SIGTERM);
  ASSERT_TRUE(eventually([&] { return second->hasEnded(); })) << second->log();
  EXPECT_EQ(second->exitStatus(), 0) << second->log();
}

}  // namespace
}  // namespace afterglow::nodes::recorder_node_ros_test
