// Where a replay is made to go: parts, seeking, steps, loops, gaps, pauses at topics, other names.
#include <gtest/gtest.h>
#include <malloc.h>

#include <cstddef>
#include <fstream>
#include <nlohmann/json.hpp>

#include "replay/play/scene_at.hpp"
#include "tests/support/player_world.hpp"

namespace afterglow::replay::player_transport_test {
namespace {

using namespace test;
using PlayerTransport = PlayerWorld;

const Channel kLights =
    channelOf("/lights", "visualization_msgs/MarkerArray",
              withTypes("Marker[] markers\n", "visualization_msgs/Marker",
                        "Header header\nstring ns\nint32 id\nint32 action\nduration lifetime\n",
                        "std_msgs/Header", kHeader));

struct Light {
  std::int32_t id;
  double lifetime_s = 0;
  std::int32_t action = 0;
};

Bytes lights(const std::vector<Light>& wanted, const std::string& ns = "") {
  const Schema schema = schemaOf(kLights);
  Array markers;
  for (const Light& light : wanted) {
    markers.push_back(test::blank(schema, "visualization_msgs/Marker"));
    test::at(markers.back(), "ns") = ns;
    test::at(markers.back(), "id") = light.id;
    test::at(markers.back(), "action") = light.action;
    test::at(markers.back(), "lifetime") = RosDuration{
        static_cast<std::int32_t>(light.lifetime_s),
        static_cast<std::int32_t>((light.lifetime_s - static_cast<int>(light.lifetime_s)) * 1e9)};
  }
  return encode(schema, Object{{"markers", markers}});
}

/// "id:lifetime" of each marker, "clear" for one that clears.
std::string lightsText(const Bytes& bytes) {
  Value message = decode(schemaOf(kLights), bytes);
  std::string text;
  for (Value& marker : std::get<Array>(test::at(message, "markers"))) {
    const auto lifetime = std::get<RosDuration>(test::at(marker, "lifetime"));
    const bool clears = std::get<std::int32_t>(test::at(marker, "action")) == 3;
    text += (text.empty() ? "" : " ") +
            (clears ? "clear"
                    : std::to_string(std::get<std::int32_t>(test::at(marker, "id"))) + ":" +
                          std::to_string(lifetime.sec * 1000 + lifetime.nsec / 1000000));
  }
  return text;
}

// ------------------------------------------------------------------------------------------ scene

struct SceneBuilder {
  SceneAt scene;
  std::uint64_t sequence = 0;
  void add(const Channel& channel, std::int64_t channel_id, std::int64_t at_ms, Bytes bytes,
           Modality modality = Modality::Ar) {
    scene.add(channel, modality, {channel_id, {at_ms * kMs}, ++sequence, {}, std::move(bytes)});
  }
  std::vector<std::string> light(std::int64_t at_ms) const {
    std::vector<std::string> texts;
    for (const Message& message : scene.light({at_ms * kMs})) {
      texts.push_back(std::to_string(message.received.ns / kMs) + " " + lightsText(message.bytes));
    }
    return texts;
  }
};
using Texts = std::vector<std::string>;

TEST(SceneAt, keepsLiveMarkersWithTheRestOfTheirLifetimes) {
  SceneBuilder s;
  s.add(kLights, 1, 0, lights({{1}, {2, 2.0}, {3, 0.5}}));
  s.add(kLights, 1, 100, lights({{4, 3.0}}));
  s.add(kLights, 1, 200, lights({{1, 1.0}}));
  EXPECT_EQ(s.light(600), (Texts{"0 2:1400", "100 4:2500", "200 1:600"}));
  EXPECT_EQ(s.light(1200), (Texts{"0 2:800", "100 4:1900"})) << "over at its last nanosecond";
}

TEST(SceneAt, tellsMarkersApartByNamespaceAndIdAndDeletesThem) {
  SceneBuilder s;
  s.add(kLights, 1, 0, lights({{1}, {2}}, "a"));
  s.add(kLights, 1, 10, lights({{1}}, "b"));
  s.add(kLights, 1, 20, lights({{1, 0, 2}}, "a"));
  EXPECT_EQ(s.light(30), (Texts{"0 2:0", "10 1:0"}));
  s.add(kLights, 1, 40, lights({{0, 0, 3}, {7}}, "c"));
  EXPECT_EQ(s.light(50), (Texts{"40 7:0"}));
}

TEST(SceneAt, keepsTheLastCloudAndWhatEachPublisherLatched) {
  SceneBuilder s;
  Channel latched = textChannel("/state");
  latched.latching = true;
  s.add(kCloud, 1, 0, cloud(1));
  s.add(latched, 2, 1, text("one"));
  s.add(latched, 3, 2, text("other"));
  s.add(kCloud, 1, 3, cloud(2));
  s.add(latched, 2, 4, text("two"));
  s.add(textChannel("/event"), 5, 5, text("past"));
  s.add(kLights, 6, 6, Bytes(3, 1));  // no message of its type
  const auto light = s.scene.light({10 * kMs});
  ASSERT_EQ(light.size(), 3u);
  EXPECT_EQ(light[0].bytes, text("other"));
  EXPECT_EQ(light[1].bytes, cloud(2));
  EXPECT_EQ(light[2].bytes, text("two"));
}

TEST(SceneAt, keepsTheLastGoalOfEachActionUnlessItWasCanceled) {
  SceneBuilder s;
  const Channel gripper = trajectoryGoalChannel("/gripper/goal");
  const Channel cancel =
      channelOf("/arm/follow_joint_trajectory/cancel", "actionlib_msgs/GoalID", kGoalId);
  s.add(kArm, 1, 0, goalMessage("a", {1}), Modality::Body);
  s.add(kArm, 1, 10, goalMessage("b", {1}), Modality::Body);
  s.add(gripper, 2, 20, goalMessage("c", {1}), Modality::Body);
  s.add(kCmdVel, 3, 30, twist(1), Modality::Body);
  ASSERT_EQ(s.scene.targets().size(), 2u);
  EXPECT_EQ(goalId(s.scene.targets()[0].bytes), "b");
  s.add(cancel, 4, 40, cancelMessage("b"), Modality::Body);
  ASSERT_EQ(s.scene.targets().size(), 1u);
  EXPECT_EQ(goalId(s.scene.targets()[0].bytes), "c");
}

// -------------------------------------------------------------------------------------- transport

TEST_F(PlayerTransport, beginsInTheMiddleWithWhatIsInForceThere) {
  record(kLights, 0, lights({{1}, {2, 2.0}}));
  record(kCloud, 100, cloud(1, {kBegin + 100 * kMs}));
  record(kCloud, 1200, cloud(2));
  record(kSay, 1300, test::text("out"));
  plan_options.start_s = 1;
  plan_options.duration_s = 0.25;
  const PlayReport report = play(5000);
  EXPECT_EQ(sink.times("/points"), (Times{-5, 200, 2250}));
  EXPECT_NEAR(static_cast<double>(cloudStamp(sink.on("/points")[0].bytes).ns - 2 * kBegin), 1e9,
              1e4)
      << "as if it came now: tf forgets";
  EXPECT_EQ(lightsText(sink.on("/lights")[0].bytes), "1:0 2:1000");
  EXPECT_TRUE(sink.on("/robotsound").empty());
  EXPECT_EQ(report.planned_ns, 250 * kMs);
  EXPECT_EQ(report.actual_ns, 250 * kMs);
}

TEST_F(PlayerTransport, seeksWithTheLightRebuilt) {
  record(kLights, 0, lights({{1, 5.0}}));
  for (int i = 0; i < 10; ++i) record(kSay, i * 500, test::text(std::to_string(i)));
  at(700, [this] { player->seek({3'000'000'000}); });
  at(1700, [this] { player->seek({0}); });
  play(4501);
  EXPECT_EQ(sink.times("/robotsound"),
            (Times{0, 500, 705, 1205, 1705, 2205, 2705, 3205, 3705, 4205, 4705, 5205, 5705, 6205}));
  std::vector<std::string> shown;
  for (const Sent& sent : sink.on("/lights")) shown.push_back(lightsText(sent.bytes));
  EXPECT_EQ(shown, (Texts{"1:5000", "clear", "1:2000", "clear", "1:5000", "clear"}));
}

/// Each on the connection that rosbag play has for it, so that who subscribes later gets it again.
TEST_F(PlayerTransport, seeksWithWhatEachLatchedPublisherHeld) {
  const auto by = [](const char* node) {
    Channel channel = kCloud;
    channel.latching = true;
    channel.caller_id = node;
    return channel;
  };
  record(by("/front"), 0, cloud(1));
  record(by("/rear"), 100, cloud(2));
  record(by("/front"), 1000, cloud(3));
  at(500, [this] { player->seek({2'000'000'000}); });
  play(3000);
  using Shown = std::vector<std::pair<std::string, std::uint32_t>>;
  Shown shown;
  for (const Sent& sent : sink.on("/points")) {
    EXPECT_TRUE(sent.channel.latching);
    shown.emplace_back(sent.channel.caller_id, cloudWidth(sent.bytes));
  }
  const Shown cleared{{"/front", 0}, {"/rear", 0}};
  ASSERT_EQ(shown.size(), 8u);
  EXPECT_EQ(Shown(shown.begin(), shown.begin() + 2), (Shown{{"/front", 1}, {"/rear", 2}}));
  EXPECT_EQ(Shown(shown.begin() + 2, shown.begin() + 4), cleared);
  EXPECT_EQ(Shown(shown.begin() + 4, shown.begin() + 6), (Shown{{"/rear", 2}, {"/front", 3}}));
  EXPECT_EQ(Shown(shown.begin() + 6, shown.end()), cleared) << "at the end";
}

TEST_F(PlayerTransport, refusesToSeekOutsideOfThePart) {
  record(kSay, 0, test::text("a"));
  at(10, [this] {
    EXPECT_THROW(player->seek({2'000'000'000}), std::runtime_error);
    EXPECT_THROW(player->seek({-1}), std::runtime_error);
  });
  record(kSay, 20, test::text("b"));
  EXPECT_TRUE(play(1000).is_complete);
}

TEST_F(PlayerTransport, seeksWithTheBodyStandingFirstAndGivesItTimeToGetThere) {
  record(kCmdVel, 0, twist(0.2));
  record(kArm, 0, goalMessage("a", {1.0}));
  record(kArm, 2000, goalMessage("b", {1.0, 2.0}));
  record(kCmdVel, 3600, twist(0.3));
  options.seek_lead_s = 4;
  at(500, [this] { player->seek({3'500'000'000}); });
  at(6500, [this] { player->onGoalStatus("fresh-2", 3); });
  const PlayReport report = play(4000);
  EXPECT_EQ(sink.times("/arm/follow_joint_trajectory/cancel"), Times{500});
  const std::vector<Sent> goals = sink.on(kArm.topic);
  ASSERT_EQ(goals.size(), 2u);
  EXPECT_EQ(goals[1].at_ms, 500);
  EXPECT_EQ(timesFromStart(goals[1].bytes), std::vector<double>{4.5}) << "2 s less 1.5 s, and 4 s";
  EXPECT_EQ(sink.times("/cmd_vel"), (Times{0, 500, 4600, 5000, 6500, 6500}));
  EXPECT_EQ(sink.on("/cmd_vel")[1].bytes, twist(0));
  EXPECT_TRUE(report.is_complete);
}

TEST_F(PlayerTransport, sendsNothingAgainThatOnlyARuleCanStop) {
  const Channel crane = test::twistChannel("/crane/command");
  MotionStop stop;
  stop.kind = StopKind::Zero;
  stop.rule = "rules.yaml:1";
  plan_options.rewriting.stops[crane.topic] = stop;
  record(crane, 0, twist(0.4));
  record(crane, 3000, twist(0.5));
  at(500, [this] { player->seek({2'000'000'000}); });
  const PlayReport report = play(4000);
  const std::vector<Sent> sent = sink.on(crane.topic);
  ASSERT_GE(sent.size(), 3u);
  EXPECT_EQ(sent[1].bytes, twist(0)) << "it stands at once";
  const auto next = std::find_if(sent.begin() + 1, sent.end(),
                                 [](const Sent& s) { return s.bytes != twist(0); });
  ASSERT_NE(next, sent.end());
  EXPECT_EQ(next->bytes, twist(0.5)) << "until it is told where to go";
  ASSERT_EQ(report.notes.size(), 1u);
  EXPECT_EQ(report.notes[0].find("what /crane/command was told until 2.00 s was not sent"), 0u);
}

TEST_F(PlayerTransport, sendsTargetsOfASeekInAPauseOnlyWhenItGoesOn) {
  record(kArm, 0, goalMessage("a", {1.0}));
  options.starts_paused = true;
  options.seek_lead_s = 4;
  at(100, [this] { player->seek({2'000'000'000}); });
  at(300, [this] {
    EXPECT_TRUE(sink.sent.empty());
    player->resume();
  });
  at(900, [this] { player->pause(); });  // on its way there
  at(1900, [this] { player->resume(); });
  at(5900, [this] { player->onGoalStatus("fresh-2", 3); });
  play(3000);
  const std::vector<Sent> goals = sink.on(kArm.topic);
  ASSERT_EQ(goals.size(), 2u);
  EXPECT_EQ(goals[0].at_ms, 300);
  EXPECT_EQ(timesFromStart(goals[0].bytes), std::vector<double>{4.0});
  EXPECT_EQ(timesFromStart(goals[1].bytes), std::vector<double>{4.0}) << "all of it again";
}

TEST_F(PlayerTransport, standsWhileItIsHaltedWhateverElseIsAskedFor) {
  record(kCmdVel, 0, twist(0.5));
  record(kCmdVel, 200, twist(0.6));
  at(100, [this] { player->halt(true); });
  at(150, [this] { player->resume(); });
  at(1100, [this] { player->pause(); });
  at(1200, [this] { player->halt(false); });
  at(1300, [this] { player->resume(); });
  play(300);
  const std::vector<Sent> sent = sink.on(kCmdVel.topic);
  ASSERT_GE(sent.size(), 4u);
  EXPECT_EQ(sent[0].at_ms, 0);
  EXPECT_EQ(sent[1].at_ms, 100) << "a zero";
  EXPECT_EQ(sent[1].bytes, twist(0));
  EXPECT_EQ(sent[2].at_ms, 1300) << "the velocity in force";
  EXPECT_EQ(sent[2].bytes, twist(0.5));
  EXPECT_EQ(sent[3].at_ms, 1400);
}

TEST_F(PlayerTransport, sendsNoBurstAfterAStallAndASeek) {
  for (int i = 0; i < 100; ++i) record(kCmdVel, i * 10, twist(1 + i));
  at(100, [this] { player->seek({500'000'000}); });
  sink.on_publish = [this](const Sent& sent) {
    if (sent.bytes == twist(61)) clock.stall(105 * kMs);
  };
  play(1000);
  const std::vector<Sent> sent = sink.on("/cmd_vel");
  const auto stalled =
      std::find_if(sent.begin(), sent.end(), [](const Sent& s) { return s.bytes == twist(61); });
  ASSERT_NE(stalled, sent.end());
  EXPECT_EQ(std::next(stalled)->bytes, twist(71));
}

TEST_F(PlayerTransport, stepsThroughMessagesWhilePaused) {
  for (int i = 0; i < 4; ++i) record(kSay, i * 1000, test::text(std::to_string(i)));
  options.starts_paused = true;
  at(100, [this] { player->playNext(1); });
  at(200, [this] { player->playNext(2); });
  at(300, [this] {
    EXPECT_EQ(player->progress().position.ns, 2000 * kMs);
    EXPECT_EQ(player->progress().state, PlayProgress::State::Paused);
    player->resume();
    EXPECT_THROW(player->playNext(1), std::runtime_error);
  });
  play(3500);
  EXPECT_EQ(sink.times("/robotsound"), (Times{100, 200, 200, 1300}));
}

TEST_F(PlayerTransport, hasNoSingleStepsLoopsAndHasteForTheBody) {
  record(kCmdVel, 0, twist(0.2));
  at(10, [this] { EXPECT_THROW(player->playNext(1), std::runtime_error); });
  play(100);
  options.is_looping = true;
  EXPECT_THROW(play(100), std::logic_error);
  options.is_looping = false;
  options.is_immediate = true;
  EXPECT_THROW(play(100), std::logic_error);
}

TEST_F(PlayerTransport, loopsWithTheLightOutBetweenRounds) {
  record(kCloud, 0, cloud(1));
  options.is_looping = true;
  at(2500, [this] { player->stop("enough"); });
  play(1000);
  EXPECT_EQ(sink.times("/points"), (Times{0, 1000, 1005, 2005, 2010, 2500}));
  EXPECT_EQ(cloudWidth(sink.on("/points")[1].bytes), 0u);
}

/// Pages of memory that this process holds.
std::size_t residentPages() {
  std::size_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident;
}

TEST_F(PlayerTransport, loopsForADayWithoutDriftOrLeak) {
  mallopt(M_ARENA_MAX, 1);  // heaps of their own, which threads get by chance, are no leak
  const std::int64_t minute = 60'000, whole = minute + 5;  // as every beginning, 5 ms ahead
  for (int i = 0; i < 12; ++i) record(kCloud, i * 5000, cloud(1));
  options.is_looping = true;
  std::int64_t last = 0;
  std::size_t rounds = 0, pages_after_an_hour = 0;
  sink.on_publish = [&](const Sent& sent) {
    last = sent.at_ms;
    if (cloudWidth(sent.bytes) == 0 && ++rounds == 60) pages_after_an_hour = residentPages();
    clock.stall(300'000);  // each send takes 0.3 ms
    sink.sent.clear();
  };
  at(1440 * whole - 500, [this] { player->stop("enough"); });
  const PlayReport report = play(minute);
  EXPECT_EQ(rounds, 1440u);
  EXPECT_EQ(last, 1440 * whole - 500);
  EXPECT_EQ(report.topics.at(0).second.published, 1440u * 12);
  EXPECT_EQ(report.topics.at(0).second.lateness.max(), 0);
  EXPECT_EQ(report.topics.at(0).second.lateness.drift(), 0);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they keep freed memory
  EXPECT_LT(residentPages(), pages_after_an_hour + 64) << "a quarter of a megabyte";
#endif
}

TEST_F(PlayerTransport, endsALoopThatHoldsNothing) {
  record(kSay, 0, test::text("a"));
  options.is_looping = true;
  plan_options.start_s = 0.5;
  EXPECT_TRUE(play(1000).is_complete);
}

TEST_F(PlayerTransport, skipsTimeWithoutMessagesButNotGoalsUnderWay) {
  record(kSay, 0, test::text("a"));
  record(kSay, 60'000, test::text("b"));
  record(kArm, 60'000, goalMessage("a", {5.0}));
  record(kSay, 90'000, test::text("c"));
  options.skip_empty_s = 2;
  at(9000, [this] { player->onGoalStatus("fresh-1", 3); });
  play(90'001);
  EXPECT_EQ(sink.times("/robotsound"), (Times{0, 2000, 9000}));
}

TEST_F(PlayerTransport, playsAllAtOnce) {
  for (int i = 0; i < 5; ++i) record(kSay, i * 1000, test::text("x"));
  options.is_immediate = true;
  EXPECT_GE(play(5000).actual_ns, 0);
  EXPECT_EQ(sink.times("/robotsound"), (Times{-5, -5, -5, -5, -5}));
}

TEST_F(PlayerTransport, pausesBeforeTopicsThatAreToPauseIt) {
  record(kSay, 0, test::text("a"));
  record(kMarkers, 100, markers(1));
  record(kMarkers, 200, markers(1));
  record(kMarkers, 300, markers(1));
  options.pause_topics = {"/markers"};
  options.clear_projection = false;
  at(1000, [this] { player->resume(); });
  at(2000, [this] {
    EXPECT_EQ(player->progress().state, PlayProgress::State::Paused);
    EXPECT_FALSE(player->togglePauseTopics());
    player->resume();
  });
  play(400);
  EXPECT_EQ(sink.times("/markers"), (Times{1000, 2000, 2100}));
}

TEST_F(PlayerTransport, goesOnFromWhereLightStalled) {
  record(kSay, 0, test::text("stall"));
  for (int i = 1; i <= 3; ++i) record(kMarkers, i * 100, markers(1));
  options.clear_projection = false;
  sink.on_publish = [this](const Sent& sent) {
    if (sent.topic == "/robotsound") clock.stall(600'000 * kMs);
  };
  const PlayReport report = play(400);
  EXPECT_EQ(sink.times("/markers"), (Times{600'000, 600'100, 600'200})) << "ten minutes, no burst";
  EXPECT_EQ(report.notes.size(), 1u);
}

TEST_F(PlayerTransport, staysUntilItIsStoppedWhereItIsKeptAlive) {
  record(kCloud, 0, cloud(1));
  options.keeps_alive = true;
  at(60'000, [this] { player->stop("enough"); });
  EXPECT_TRUE(play(1000).is_complete);
  EXPECT_EQ(sink.times("/points"), (Times{0, 60'000}));
}

TEST_F(PlayerTransport, leavesStampsWhereRecordedTimeIsPlayed) {
  record(kCloud, 10, cloud(1, {kBegin + 10 * kMs}));
  record(twistChannel("/odom_tf/tf"), 20, twist(1));
  options.has_recorded_time = true;
  play(1000);
  EXPECT_EQ(cloudStamp(sink.on("/points")[0].bytes).ns, kBegin + 10 * kMs);
  EXPECT_EQ(sink.on("/odom_tf/tf").size(), 1u + 2) << "and what else belongs to that time";
}

TEST_F(PlayerTransport, choosesTopicsAndNamesThem) {
  record(kArm, 0, goalMessage("a", {1}));
  record(kSay, 0, test::text("a"));
  record(kCloud, 0, cloud(1));
  record(textChannel("/other"), 0, test::text("b"));
  plan_options.exclude = {"/points"};
  plan_options.exclude_regex = "/oth.*";
  plan_options.prefix = "/robot2";
  plan_options.remap = {{"/robotsound", "/voice"}};
  at(500, [this] { player->stop("enough"); });
  play(1000);
  std::vector<std::string> names;
  for (const Sent& sent : sink.sent) names.push_back(sent.topic);
  EXPECT_EQ(names, (Texts{"/robot2" + kArm.topic, "/voice",
                          "/robot2/arm/follow_joint_trajectory/cancel"}));
  EXPECT_EQ(plan.topics.at(1).why_not, "the topic is not asked for");
}

TEST_F(PlayerTransport, refusesPlansThatMakeNoSense) {
  record(kSay, 0, test::text("a"));
  record(kCloud, 0, cloud(1));
  play(1000);
  const auto refusal = [this](const std::function<void(PlanOptions&)>& change) -> std::string {
    PlanOptions wrong;
    change(wrong);
    try {
      makePlan(*store, plan.behavior, wrong);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal([](auto& o) { o.topics = {"/pionts"}; }), "the behavior has no topic /pionts");
  EXPECT_EQ(refusal([](auto& o) { o.start_s = 1.5; }),
            "nothing of the behavior lies in that part: it is 1000 ms long");
  EXPECT_EQ(refusal([](auto& o) {
              o.remap = {{"/points", "/robotsound"}};
            }),
            "/points and /robotsound would both be published on /robotsound");
  EXPECT_EQ(refusal([](auto& o) { o.prefix = "robot2"; }),
            "'robot2' is no topic: it begins with no slash");
  EXPECT_NE(refusal([](auto& o) { o.regex = "("; }).find("is no regular expression"),
            std::string::npos);
}

TEST_F(PlayerTransport, tellsOfDamagedMessagesOnce) {
  for (int i = 0; i < 4; ++i) record(kSay, i * 100, test::text(std::to_string(i)));
  at(250, [this] { player->seek({50 * kMs}); });
  const PlayReport report = play(1000, "", [this] { store->damage(1); });
  EXPECT_TRUE(report.is_complete);
  EXPECT_EQ(sink.on("/robotsound").size(), 4u) << "0, 2, and after the seek 2 and 3";
  EXPECT_EQ(report.notes,
            (Texts{"1 damaged message was left out; afterglow store check names what is damaged"}));
}

TEST_F(PlayerTransport, standsWhileItIsHeldButNotBeyondTheLastMessage) {
  for (int i = 0; i < 3; ++i) record(kSay, i * 100, test::text(std::to_string(i)));
  at(50, [this] { player->hold(true); });
  at(80, [this] {
    EXPECT_TRUE(player->progress().is_held);
    EXPECT_EQ(player->progress().state, PlayProgress::State::Playing);
    EXPECT_FALSE(player->isPauseWanted());
  });
  at(1050, [this] { player->hold(false); });
  at(1250, [this] { player->hold(true); });
  EXPECT_TRUE(play(1000).is_complete);
  EXPECT_EQ(sink.times("/robotsound"), (Times{0, 1100, 1200}));
}

}  // namespace
}  // namespace afterglow::replay::player_transport_test
