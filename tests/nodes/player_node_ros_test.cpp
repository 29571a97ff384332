// player_node's services and its clocks, seen from outside; and the files a replay is given.
#include <afterglow/Burst.h>
#include <afterglow/GetRate.h>
#include <afterglow/IsPaused.h>
#include <afterglow/PlayBehavior.h>
#include <afterglow/ReplayStatus.h>
#include <afterglow/Seek.h>
#include <afterglow/SetRate.h>
#include <geometry_msgs/PointStamped.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>
#include <std_msgs/String.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <csignal>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "nodes/player/robot_file.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/terminal_process.hpp"

namespace afterglow::nodes::player_node_ros_test {
namespace {

using test::eventually;
using Texts = std::vector<std::string>;

constexpr std::int64_t kSecond = 1'000'000'000;

/// A minute that says 0, 1, 2, ... on /say, one a second from 1000 s on, and draws nothing.
std::int64_t recordCounting(const std::string& path) {
  const auto store = replay::openStore(path, replay::OpenMode::ReadWrite);
  const std::int64_t recording = store->addRecording({0, "", "by hand", ""});
  const std::int64_t channel = store->addChannel(recording, test::stringChannel("/say"));
  std::vector<replay::Message> messages;
  for (int i = 0; i < 60; ++i) {
    messages.push_back(test::stringMessage(channel, (1000 + i) * kSecond,
                                           static_cast<std::uint64_t>(i), std::to_string(i)));
  }
  store->append(messages);
  return store->addBehavior(
      test::sampleBehavior(recording, {"/say"}, 1000 * kSecond, 1060 * kSecond));
}

struct World {
  World() {
    node = std::make_unique<ros::NodeHandle>();
    behavior = recordCounting(store);
    node->setParam("/player_node/also", Texts{"/say", "/of/another/behavior"});
    player =
        std::make_unique<test::NodeProcess>(
            Texts{AFTERGLOW_TEST_PLAYER_NODE, "_store:=" + store, "_allow_motion:=true"});
    say = node->subscribe<std_msgs::String>("/say", 100, [this](const auto& message) {
      const std::lock_guard<std::mutex> lock(mutex);
      said.push_back(message->data);
    });
    status =
        node->subscribe<ReplayStatus>("/player_node/status", 1000, [this](const auto& message) {
          const std::lock_guard<std::mutex> lock(mutex);
          statuses.push_back(*message);
        });
    clock = node->subscribe<rosgraph_msgs::Clock>("/clock", 100, [this](const auto& message) {
      const std::lock_guard<std::mutex> lock(mutex);
      times.push_back(message->clock.toSec());
    });
    spinner.start();
  }
  ~World() { spinner.stop(); }

  template <typename T>
  T seen(const T& value) {
    const std::lock_guard<std::mutex> lock(mutex);
    return value;
  }
  void forget() {
    const std::lock_guard<std::mutex> lock(mutex);
    said.clear();
    statuses.clear();
    times.clear();
  }

  test::TestGraph graph;
  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  std::int64_t behavior = 0;
  std::unique_ptr<ros::NodeHandle> node;
  ros::AsyncSpinner spinner{2};
  std::unique_ptr<test::NodeProcess> player;
  ros::Subscriber say, status, clock;
  std::mutex mutex;
  Texts said;
  std::vector<ReplayStatus> statuses;
  std::vector<double> times;
};

struct PlayerNodeRos : testing::Test {
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() {
    delete world;
    ros::shutdown();
  }
  template <typename Service>
  static typename Service::Response call(const std::string& name,
                                         const typename Service::Request& request = {}) {
    Service service;
    service.request = request;
    EXPECT_TRUE(ros::service::waitForService("/player_node/" + name, ros::Duration(30)));
    EXPECT_TRUE(ros::service::call("/player_node/" + name, service)) << name;
    return service.response;
  }
  static bool trigger(const std::string& name) { return call<std_srvs::Trigger>(name).success; }
  static Texts playing(const Texts& options) {
    Texts words{AFTERGLOW_TEST_COMMAND, "play",    std::to_string(world->behavior),
                "--keep-light",         "--store", world->store,
                "--allow-motion",       "--also",  "/say"};
    words.insert(words.end(), options.begin(), options.end());
    return words;
  }
  static std::uint8_t state() {
    const auto statuses = world->seen(world->statuses);
    if (statuses.empty()) return ReplayStatus::IDLE;
    return statuses.back().state;
  }
  static bool heard(const Texts& texts) {
    return eventually([&] { return world->seen(world->said) == texts; });
  }
  static World* world;
};
World* PlayerNodeRos::world = nullptr;

TEST_F(PlayerNodeRos, isCommandedByServices) {
  EXPECT_FALSE(trigger("pause")) << "nothing is played";
  PlayBehavior::Request wrong;
  wrong.name = "dance";
  EXPECT_EQ(call<PlayBehavior>("play", wrong).message,
            "there is no behavior \"dance\"; there are: pick");
  wrong.name = "pick";
  wrong.rate = -1;
  EXPECT_EQ(call<PlayBehavior>("play", wrong).message,
            "rate: -1 is no number of 0.001 to 1000");
  PlayBehavior::Request play;
  play.selector = "the last pick";
  play.start = 10;
  play.paused = true;
  const auto begun = call<PlayBehavior>("play", play);
  ASSERT_TRUE(begun.success) << begun.message;
  ASSERT_TRUE(eventually([] { return state() == ReplayStatus::PAUSED; }));
  EXPECT_TRUE(call<IsPaused>("is_paused").paused);
  EXPECT_TRUE(trigger("play_next"));
  EXPECT_TRUE(heard({"10"}));
  Burst::Request burst;
  burst.num_messages = 2;
  EXPECT_TRUE(call<Burst>("burst", burst).success);
  EXPECT_TRUE(heard({"10", "11", "12"}));
  burst.num_messages = 0;
  EXPECT_TRUE(call<Burst>("burst", burst).success);
  EXPECT_TRUE(eventually([] { return world->seen(world->said).size() == 50; })) << "all";
  Seek::Request seek;
  seek.position = 60.5;
  EXPECT_FALSE(call<Seek>("seek", seek).success);
  seek.position = 30;
  EXPECT_TRUE(call<Seek>("seek", seek).success);
  SetRate::Request rate;
  rate.rate = -1;
  EXPECT_EQ(call<SetRate>("set_rate", rate).message, "a rate is 0.001 to 1000, not -1");
  rate.rate = 50;
  EXPECT_TRUE(call<SetRate>("set_rate", rate).success);
  EXPECT_EQ(call<GetRate>("get_rate").rate, 50);
  EXPECT_TRUE(trigger("toggle_paused"));
  EXPECT_FALSE(call<IsPaused>("is_paused").paused);
  EXPECT_TRUE(eventually([] {
    const auto said = world->seen(world->said);
    return said.size() > 50 && said.back() == "59";  // again: the burst ended with it, too
  }));
  EXPECT_EQ(world->seen(world->said)[50], "30");
  EXPECT_TRUE(eventually([] { return state() == ReplayStatus::IDLE; }));
  world->forget();
}

TEST_F(PlayerNodeRos, saysTenTimesASecondWhereItIsAndStopsWhenTold) {
  PlayBehavior::Request play;
  play.behavior_id = world->behavior;
  ASSERT_TRUE(call<PlayBehavior>("play", play).success);
  ASSERT_TRUE(eventually([] { return world->seen(world->statuses).size() > 15; }));
  const auto statuses = world->seen(world->statuses);
  EXPECT_GT(statuses.back().position, 0.5);
  EXPECT_DOUBLE_EQ(statuses.back().duration, 60);
  std_srvs::SetBool::Request pause;
  pause.data = true;
  EXPECT_TRUE(call<std_srvs::SetBool>("pause_playback", pause).success);
  EXPECT_TRUE(eventually([] { return state() == ReplayStatus::PAUSED; }));
  EXPECT_TRUE(trigger("stop"));
  EXPECT_TRUE(eventually([] { return state() == ReplayStatus::IDLE; }));
  EXPECT_EQ(world->seen(world->statuses).back().message, "stopped");
  world->forget();
}

TEST_F(PlayerNodeRos, givesTheRecordingsTimeOnClockAndSharesItWithNobody) {
  const Texts play = playing({"--start", "5", "--duration", "1", "--clock", "--hz", "200"});
  {
    test::NodeProcess process(play);
    EXPECT_EQ(process.exitStatus(), 0) << process.log();
  }
  EXPECT_TRUE(heard({"5"}));
  const std::vector<double> times = world->seen(world->times);
  ASSERT_GT(times.size(), 120u) << "200 Hz";
  EXPECT_NEAR(times.front(), 1005, 0.5);
  EXPECT_NEAR(times.back(), 1006, 0.1);
  bool has_parameter = false;
  EXPECT_FALSE(world->node->getParam("/use_sim_time", has_parameter));
  ros::Publisher other = world->node->advertise<rosgraph_msgs::Clock>("/clock", 1);
  test::NodeProcess refused(play);
  EXPECT_EQ(refused.exitStatus(), 1);
  EXPECT_NE(refused.log().find("/test publishes /clock, too"), std::string::npos) << refused.log();
  world->forget();
}

TEST_F(PlayerNodeRos, goesAsAnotherClockDoes) {
  ros::Publisher clock = world->node->advertise<rosgraph_msgs::Clock>("/clock", 100);
  test::NodeProcess process(playing({"--follow-clock", "--duration", "3"}));
  const auto showTime = [&](double seconds) {
    rosgraph_msgs::Clock message;
    message.clock = ros::Time(seconds);
    clock.publish(message);
  };
  ASSERT_TRUE(eventually([&] { return clock.getNumSubscribers() >= 2; })) << "this one, and it";
  // It says the first word 5 ms after its begin, whatever time it is then.
  double time = 50;
  ASSERT_TRUE(eventually([&] {
    showTime(time += 0.01);
    return world->seen(world->said).size() == 1;
  }));
  const double first = time;
  while (world->seen(world->said).size() < 3 && time < first + 5) {
    showTime(time += 0.1);
    ros::WallDuration(0.02).sleep();
  }
  EXPECT_NEAR(time - first, 2.0, 0.5);
  EXPECT_TRUE(heard({"0", "1", "2"}));
  ASSERT_TRUE(eventually([&] {
    showTime(time += 0.5);
    return process.log().find("/say") != std::string::npos;  // its table
  }));
  EXPECT_EQ(process.exitStatus(), 0) << process.log();
  world->forget();
}

TEST_F(PlayerNodeRos, refusesToPlayToNobodyIfThatIsAskedFor) {
  const Texts play =
      playing({"--remap", "/say:=/unheard", "--wait-for-subscribers", "0.1", "--immediate"});
  test::NodeProcess tells(play);
  EXPECT_EQ(tells.exitStatus(), 0) << tells.log();
  EXPECT_NE(tells.log().find("nobody listened on /unheard"), std::string::npos) << tells.log();
  Texts strict = play;
  strict.insert(strict.end(), {"--unheard", "abort"});
  test::NodeProcess refuses(strict);
  EXPECT_EQ(refuses.exitStatus(), 1);
  EXPECT_NE(refuses.log().find("nobody listens on /unheard"), std::string::npos) << refuses.log();
}

// --------------------------------------------------------------------------------------- terminal

TEST_F(PlayerNodeRos, isCommandedByKeysAndLeavesTheTerminalAsItWas) {
  test::TerminalProcess terminal(playing({"--pause", "--start", "10"}));
  ASSERT_TRUE(terminal.shows("[PAUSED ]  10.00 / 60.00 s"));
  EXPECT_FALSE(terminal.isAsBefore()) << "keys come without Enter, unseen";
  terminal.press("s");
  EXPECT_TRUE(heard({"10"}));
  terminal.press("\x1b[C");
  EXPECT_TRUE(terminal.shows("15.00 / 60.00 s"));
  terminal.press("\x1b[D");
  EXPECT_TRUE(terminal.shows("10.00 / 60.00 s"));
  terminal.press("\x1b[C\x1b[5~xs");  // a page up means nothing
  EXPECT_TRUE(terminal.shows("15.00 / 60.00 s"));
  EXPECT_TRUE(heard({"10", "15"}));
  terminal.press("\x1b[A+\x1b[B");
  EXPECT_TRUE(terminal.shows("rate 1.10"));
  terminal.press("t");
  EXPECT_TRUE(terminal.shows("plays through pause topics"));
  terminal.press(" ");
  EXPECT_TRUE(terminal.shows("[PLAYING]"));
  terminal.press(" ");
  EXPECT_TRUE(terminal.shows("[PAUSED ]"));
  terminal.press("q");
  EXPECT_EQ(terminal.exitStatus(), 1);
  EXPECT_TRUE(terminal.shows("stopped by a key"));
  EXPECT_TRUE(terminal.isAsBefore());
  world->forget();
}

TEST_F(PlayerNodeRos, waitsForWhoeverWorksOnWhatItSays) {
  ros::Publisher done = world->node->advertise<geometry_msgs::PointStamped>("/done", 10);
  test::TerminalProcess terminal(
      playing({"--start", "10", "--duration", "4", "--rate", "5", "--rate-control-topic", "/done",
               "--rate-control-max-delay", "0.5"}));
  geometry_msgs::PointStamped answer;
  for (const char* position : {"11.", "12."}) {
    ASSERT_TRUE(terminal.shows(std::string("[DELAYED]  ") + position));
    ASSERT_TRUE(eventually([&] { return done.getNumSubscribers() == 1; }));
    answer.header.stamp = ros::Time(1);  // of something long ago
    done.publish(answer);
    ASSERT_TRUE(terminal.shows(std::string("[DELAYED]  ") + position));
    answer.header.stamp = ros::Time::now();
    done.publish(answer);
  }
  EXPECT_EQ(terminal.exitStatus(), 0) << terminal.look();
  EXPECT_TRUE(heard({"10", "11", "12", "13"}));
  done = world->node->advertise<std_msgs::String>("/done_text", 1, true);
  done.publish(std_msgs::String());
  test::NodeProcess refused(playing({"--rate-control-topic", "/done_text"}));
  EXPECT_EQ(refused.exitStatus(), 1);
  EXPECT_NE(refused.log().find("/done_text is to control the rate, but std_msgs/String does not "
                               "begin with a header"),
            std::string::npos)
      << refused.log();
  world->forget();
}

TEST_F(PlayerNodeRos, leavesTheTerminalAsItWasWhenASignalStopsIt) {
  for (const int number : {SIGINT, SIGTERM}) {
    test::TerminalProcess terminal(playing({"--pause"}));
    ASSERT_TRUE(terminal.shows("[PAUSED ]"));
    EXPECT_FALSE(terminal.isAsBefore());
    if (number == SIGINT) terminal.press("\x03");
    if (number != SIGINT) terminal.signal(number);
    EXPECT_EQ(terminal.exitStatus(), 1);
    EXPECT_TRUE(terminal.isAsBefore());
  }
}

// ------------------------------------------------------------------------------------------ files

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(ReplayWords, readRulesAndLimits) {
  const test::TempFolder folder;
  const std::string path = folder.path("file.yaml");
  test::writeFile(path, "my_msgs/Plan: {stamp: keep, \"steps[].id\": fresh_id}\n");
  const auto rules = readRules(path);
  EXPECT_EQ(rules.types.at("my_msgs/Plan").at("stamp"), replay::RewriteRule::Keep);
  EXPECT_EQ(rules.types.at("my_msgs/Plan").at("steps[].id"), replay::RewriteRule::FreshId);
  EXPECT_TRUE(rules.also.empty());
  test::writeFile(path, "my_msgs/Plan: {stamp: keep}\nalso: [/plan, /a/b]\n");
  EXPECT_EQ(readRules(path).also, (std::vector<replay::TopicName>{"/plan", "/a/b"}));
  EXPECT_EQ(readRules(path).types.size(), 1u);
  test::writeFile(path, "also:\n  - plan\n");
  EXPECT_EQ(refusal([&] { readRules(path); }),
            path + ":2: 'plan' is no topic: it begins with no slash");
  test::writeFile(path,
                  "stops:\n  /wheel: zero\n  /drone: empty\n"
                  "  /goal: {cancel: /move_base/cancel}\n  /drive: {speed: 0.5, brakes: true}\n");
  const auto stops = readRules(path).stops;
  EXPECT_EQ(stops.at("/wheel").kind, replay::StopKind::Zero);
  EXPECT_EQ(stops.at("/drone").kind, replay::StopKind::NoPoints);
  EXPECT_EQ(stops.at("/goal").cancel_topic, "/move_base/cancel");
  EXPECT_EQ(stops.at("/drive").fields.size(), 2u);
  EXPECT_EQ(stops.at("/drive").fields.at("brakes"), 1);
  EXPECT_EQ(stops.at("/drive").fields.at("speed"), 0.5);
  EXPECT_EQ(stops.at("/drive").rule, path + ":5");
  test::writeFile(path, "stops:\n  /wheel: hold\n");
  EXPECT_EQ(refusal([&] { readRules(path); }),
            path + ":2: a stop should be zero, empty, {cancel: /TOPIC} or {FIELD: NUMBER}");
  test::writeFile(path, "stops:\n  wheel: zero\n");
  EXPECT_EQ(refusal([&] { readRules(path); }),
            path + ":2: 'wheel' is no topic: it begins with no slash");
  test::writeFile(path, "stops:\n  /drive: {speed: none}\n");
  EXPECT_EQ(refusal([&] { readRules(path); }).find(path + ":2: "), 0u);
  test::writeFile(path, "my_msgs/Plan:\n  stamp: shifted\n");
  EXPECT_EQ(refusal([&] { readRules(path); }),
            path + ":2: 'shifted' is no rule; did you mean 'shift'?");
  test::writeFile(path,
                  "linear_velocity: 0.5\njoints: {a: {velocity: 1}}\n"
                  "other_joints: {acceleration: 2}\n");
  const replay::MotionLimits limits = readLimits(path);
  EXPECT_EQ(limits.linear, 0.5);
  EXPECT_FALSE(limits.angular);
  EXPECT_EQ(limits.joints.at("a").velocity, 1);
  EXPECT_EQ(limits.other_joints.acceleration, 2);
  EXPECT_TRUE(limits.are_given);
  test::writeFile(path, "linear_velocity: fast\n");
  EXPECT_NE(refusal([&] { readLimits(path); }).find(path + ":1: "), std::string::npos);
  EXPECT_EQ(refusal([] { parseRenames({"a=b"}); }), "'a=b' is no renaming: write old:=new");
  EXPECT_EQ(parseRenames({"/a:=/b"}).at("/a"), "/b");
}

}  // namespace
}  // namespace afterglow::nodes::player_node_ros_test
