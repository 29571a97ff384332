#include "replay/play/player.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "tests/support/player_world.hpp"

namespace afterglow::replay::player_test {
namespace {

using namespace test;
using PlayerTest = PlayerWorld;

TEST_F(PlayerTest, sendsEveryMessageAtItsTimeTiesInOrderAndTheLastOneToo) {
  record(kSay, 0, test::text("first"));
  record(kMarkers, 10, test::markers(1));
  record(kSay, 10, test::text("tied"));
  record(kSay, 499, test::text("last"));
  options.clear_projection = false;
  const PlayReport report = play(500);
  EXPECT_TRUE(report.is_complete) << report.reason;
  ASSERT_EQ(sink.sent.size(), 4u);
  EXPECT_EQ(sink.sent[1].topic, "/markers");
  EXPECT_EQ(sink.times("/robotsound"), (Times{0, 10, 499}));
  EXPECT_EQ(sink.sent[3].bytes, test::text("last"));
  EXPECT_EQ(report.actual_ns, 500 * kMs);
}

/// As rosbag play: a publisher for each recorded connection, so that who subscribes later gets the
/// last message of each that latched.
TEST_F(PlayerTest, sendsOfEachLatchedPublisherByAConnectionOfItsOwn) {
  const auto by = [](const char* node, bool latches) {
    Channel channel = kMarkers;
    channel.caller_id = node;
    channel.latching = latches;
    return channel;
  };
  record(by("/plain", false), 0, test::markers(1));
  record(by("/map", true), 10, test::markers(2));
  record(by("/plan", true), 20, test::markers(3));
  record(by("/map", true), 30, test::markers(4));
  record(by("/other", false), 40, test::markers(5));
  options.clear_projection = false;
  play(100);
  std::vector<std::string> connections;
  for (const Sent& sent : sink.on("/markers")) {
    connections.push_back(sent.channel.latching ? sent.channel.caller_id : "plain");
  }
  EXPECT_EQ(connections, (std::vector<std::string>{"plain", "/map", "/plan", "/map", "plain"}));
}

TEST_F(PlayerTest, clearsWhatEachLatchedPublisherHasLeft) {
  Channel one = kMarkers, other = kMarkers;
  one.latching = other.latching = true;
  one.caller_id = "/one";
  other.caller_id = "/other";
  record(one, 0, test::markers(1));
  record(other, 10, test::markers(2));
  play(100);
  const std::vector<Sent> sent = sink.on("/markers");
  ASSERT_EQ(sent.size(), 4u);
  EXPECT_EQ(sent[2].channel.caller_id, "/one") << "a late subscriber would get its marker else";
  EXPECT_EQ(sent[3].channel.caller_id, "/other");
}

TEST_F(PlayerTest, doesNotDriftOverADay) {
  const std::int64_t day = 24 * 3600 * 1000;
  for (int i = 0; i <= 1000; ++i) record(kSay, day / 1000 * i, test::text("x"));
  sink.on_publish = [this](const Sent&) { clock.stall(300'000); };  // each send takes 0.3 ms
  const PlayReport report = play(day + 1);
  EXPECT_EQ(sink.times("/robotsound").back(), day);
  EXPECT_EQ(report.topics.at(0).second.lateness.drift(), 0);
  EXPECT_EQ(report.topics.at(0).second.lateness.max(), 0);
}

TEST_F(PlayerTest, resumesWhereItPausedWithTheRobotStandingMeanwhile) {
  for (int i = 0; i < 5; ++i) record(kCmdVel, i * 100, twist(0.5));
  at(250, [this] { player->pause(); });
  at(1250, [this] { player->resume(); });
  const PlayReport report = play(450);
  const std::vector<Sent> sent = sink.on("/cmd_vel");
  EXPECT_EQ(sink.times("/cmd_vel"), (Times{0, 100, 200, 250, 1250, 1300, 1400, 1450, 1450}));
  EXPECT_EQ(sent[3].bytes, twist(0)) << "on the pause";
  EXPECT_EQ(sent[4].bytes, twist(0.5)) << "what was in force";
  EXPECT_EQ(sent[5].bytes, twist(0.5));
  EXPECT_EQ(sent.back().bytes, twist(0)) << "at the end";
  EXPECT_TRUE(report.is_complete);
}

TEST_F(PlayerTest, doesNotCountThePauseInWhichItWasStopped) {
  for (int i = 0; i < 5; ++i) record(kSay, i * 100, text("x"));
  at(250, [this] { player->pause(); });
  at(60'000, [this] { player->stop("enough"); });
  EXPECT_EQ(play(450).actual_ns, 250 * kMs);
}

TEST_F(PlayerTest, skipsVelocitiesThatAStallHasOvertaken) {
  for (int i = 0; i < 100; ++i) record(kCmdVel, i * 10, twist(i + 1));
  record(kMarkers, 101, test::markers(1));
  record(kMarkers, 102, test::markers(2));
  record(kCloud, 103, test::cloud(1));
  record(kCloud, 104, test::cloud(2));
  sink.on_publish = [this](const Sent& sent) {
    if (sent.bytes == twist(11)) clock.stall(105 * kMs);  // at 100 ms
  };
  const PlayReport report = play(1000);
  const std::vector<Sent> sent = sink.on("/cmd_vel");
  ASSERT_GT(sent.size(), 12u);
  EXPECT_EQ(sent[10].at_ms, 100);
  EXPECT_EQ(sent[11].at_ms, 205);
  EXPECT_EQ(sent[11].bytes, twist(21)) << "the newest that is due, not ten at once";
  EXPECT_EQ(sink.on("/markers").size(), 2u + 1) << "markers add up; and one that clears";
  EXPECT_EQ(sink.on("/points").size(), 1u + 1) << "clouds replace each other";
  for (const auto& [planned, topic] : report.topics) {
    if (planned.channel.topic == "/cmd_vel") {
      EXPECT_EQ(topic.skipped, 9u);
      EXPECT_EQ(topic.published, 91u);
    }
  }
}

TEST_F(PlayerTest, doesNotStartABaseThatHasStoppedByItself) {
  record(kCmdVel, 0, twist(0.5));
  record(kSay, 10, test::text("stall"));
  record(kCmdVel, 20, twist(0.7));
  sink.on_publish = [this](const Sent& sent) {
    if (sent.topic == "/robotsound") clock.stall(300 * kMs);
  };
  play(100);
  for (const Sent& sent : sink.on("/cmd_vel")) EXPECT_NE(sent.bytes, twist(0.7));
}

TEST_F(PlayerTest, stopsWhenMotionHasStalled) {
  record(kSay, 0, test::text("stall"));
  record(kArm, 10, goalMessage("a", {1.0}));
  sink.on_publish = [this](const Sent&) { clock.stall(1500 * kMs); };
  const PlayReport report = play(100);
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(report.reason, "stalled: motion on /arm/follow_joint_trajectory/goal is 1490 ms late");
  EXPECT_TRUE(sink.on("/arm/follow_joint_trajectory/goal").empty());
}

TEST_F(PlayerTest, neverSendsAVelocityThatIsNoNumber) {
  record(kCmdVel, 0, twist(std::nan("")));
  record(kCmdVel, 1, twist(std::numeric_limits<double>::infinity()));
  const PlayReport report = play(10);
  EXPECT_TRUE(sink.sent.empty());
  EXPECT_EQ(report.topics.at(0).second.refused, 2u);
  EXPECT_EQ(report.topics.at(0).second.problem, "linear.x is inf");
}

TEST_F(PlayerTest, givesGoalsFreshIdsAndTrajectoriesANewStart) {
  const Bytes goal = goalMessage("recorded-id", {0.5, 1.0}, {1'600'000'000, 7});
  record(kArm, 0, goal);
  at(50, [this] { player->onGoalStatus("fresh-1", 3); });
  const PlayReport report = play(100);
  ASSERT_EQ(sink.sent.size(), 1u) << "and no cancel: it had succeeded";
  EXPECT_EQ(test::goalId(sink.sent[0].bytes), "fresh-1");
  EXPECT_EQ(test::trajectoryStamp(sink.sent[0].bytes), (Stamp{0}));
  EXPECT_EQ(report.goals.sent, 1u);
  EXPECT_EQ(report.goals.succeeded, 1u);
  const PlayReport again = play(100);
  EXPECT_EQ(test::goalId(sink.sent[1].bytes), "fresh-2");
}

TEST_F(PlayerTest, waitsForGoalsUnderWayAtTheEndThenStopsTheBase) {
  record(kCmdVel, 0, twist(0.5));
  record(kArm, 0, goalMessage("a", {3.0}));
  at(3000, [this] { player->onGoalStatus("fresh-1", 3); });
  const PlayReport report = play(1000);
  EXPECT_EQ(sink.times("/cmd_vel"), (Times{0, 1000, 3000}));
  EXPECT_EQ(sink.sent.back().topic, "/cmd_vel");
  EXPECT_EQ(sink.sent.back().bytes, twist(0));
  EXPECT_TRUE(sink.on("/arm/follow_joint_trajectory/cancel").empty());
  EXPECT_TRUE(report.notes.empty());
}

TEST_F(PlayerTest, cancelsGoalsThatDoNotEnd) {
  record(kArm, 0, goalMessage("a", {3.0}));
  options.goal_wait_s = 2;
  const PlayReport report = play(1000);
  const std::vector<Sent> cancels = sink.on("/arm/follow_joint_trajectory/cancel");
  ASSERT_EQ(cancels.size(), 1u);
  EXPECT_EQ(cancels[0].at_ms, 3000);
  EXPECT_EQ(cancels[0].bytes, cancelMessage("fresh-1"));
  EXPECT_EQ(report.goals.canceled, 1u);
  EXPECT_EQ(report.notes.size(), 1u);
}

TEST_F(PlayerTest, waitsForNoGoalThatNobodyHeard) {
  record(kArm, 0, goalMessage("a", {3.0}));
  sink.is_heard = false;
  play(1000);
  EXPECT_EQ(sink.sent.size(), 1u);
}

TEST_F(PlayerTest, onStopCancelsItsGoalsZeroesVelocitiesAndClearsTheLightAtOnce) {
  record(kCmdVel, 0, twist(0.5));
  record(kCloud, 0, test::cloud(5));
  record(kMarkers, 0, test::markers(2));
  record(kArm, 0, goalMessage("a", {3.0}));
  record(kCmdVel, 900, twist(0.5));
  at(500, [this] { player->stop("a person said so"); });
  const PlayReport report = play(1000);
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(report.reason, "a person said so");
  for (const char* topic :
       {"/arm/follow_joint_trajectory/cancel", "/cmd_vel", "/points", "/markers"}) {
    ASSERT_FALSE(sink.on(topic).empty()) << topic;
    EXPECT_EQ(sink.on(topic).back().at_ms, 500) << topic;
  }
  EXPECT_EQ(sink.on("/cmd_vel").back().bytes, twist(0));
  EXPECT_EQ(test::cloudWidth(sink.on("/points").back().bytes), 0u);
  EXPECT_EQ(test::markerActions(sink.on("/markers").back().bytes), std::vector<int>{3});
}

TEST_F(PlayerTest, holdsTheLightForAWhileAfterTheEnd) {
  record(kCloud, 0, test::cloud(5));
  play(1000);
  EXPECT_EQ(sink.times("/points"), (Times{0, 3000}));
}

TEST_F(PlayerTest, stopsTheBaseWhenTheStoreFailsMidway) {
  for (int i = 0; i < 5; ++i) record(kCmdVel, i * 100, twist(0.5));
  const PlayReport report = play(1000, "", [this] { store->breakReadingAfter(3); });
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(report.reason, "disk read error");
  EXPECT_EQ(sink.times("/cmd_vel"), (Times{0, 100, 200, 200}));
  EXPECT_EQ(sink.sent.back().bytes, twist(0));
}

TEST_F(PlayerTest, reportsWhatCouldNotBeSentAtTheEnd) {
  record(kCmdVel, 0, twist(0.5));
  sink.on_publish = [](const Sent& sent) {
    if (sent.bytes == twist(0)) throw std::runtime_error("the network is gone");
  };
  const PlayReport report = play(1000);
  ASSERT_FALSE(report.notes.empty());
  EXPECT_EQ(report.notes[0], "/cmd_vel: the network is gone");
}

TEST_F(PlayerTest, sendsTheRestOfATrajectoryAfterAPause) {
  record(kArm, 0, goalMessage("a", {1.0, 2.0, 3.0}));
  at(1500, [this] { player->pause(); });
  at(9000, [this] { player->resume(); });
  at(10500, [this] { player->onGoalStatus("fresh-2", 3); });
  const PlayReport report = play(4000);
  EXPECT_EQ(sink.times("/arm/follow_joint_trajectory/cancel"), Times{1500});
  const std::vector<Sent> goals = sink.on("/arm/follow_joint_trajectory/goal");
  ASSERT_EQ(goals.size(), 2u);
  EXPECT_EQ(goals[1].at_ms, 9000);
  EXPECT_EQ(test::goalId(goals[1].bytes), "fresh-2");
  EXPECT_EQ(test::timesFromStart(goals[1].bytes), (std::vector<double>{0.5, 1.5}));
  EXPECT_EQ(report.goals.sent, 1u);
  EXPECT_EQ(report.goals.succeeded, 1u);
}

TEST_F(PlayerTest, shiftsStampsByOneAmountThatAPauseChanges) {
  const auto cloudAt = [](std::int64_t ms) { return test::cloud(1, {kBegin + ms * kMs}); };
  record(kCloud, 10, cloudAt(0));  // 10 ms old when it came
  record(kCloud, 60, cloudAt(50));
  record(kCloud, 500, cloudAt(490));
  at(300, [this] { player->pause(); });
  at(1300, [this] { player->resume(); });
  play(1000);
  const std::vector<Sent> clouds = sink.on("/points");
  const std::int64_t start = 1'005'000'000 + kBegin * 2;  // ROS time of the first deadline
  EXPECT_EQ(test::cloudStamp(clouds[0].bytes).ns - start, 1000);
  EXPECT_EQ(test::cloudStamp(clouds[1].bytes).ns - start, 1000 + 50 * kMs);
  EXPECT_EQ(test::cloudStamp(clouds[2].bytes).ns - start, 3000 + 1490 * kMs);
}

TEST_F(PlayerTest, playsOnlyTheModalitiesAskedFor) {
  record(kCmdVel, 0, twist(0.5));
  record(kCloud, 0, test::cloud(5));
  record(test::twistChannel("/tf"), 0, twist(1));
  const PlayReport report = play(100, "ar");
  EXPECT_TRUE(sink.on("/cmd_vel").empty());
  EXPECT_FALSE(sink.on("/points").empty());
  EXPECT_TRUE(sink.on("/tf").empty());
  const auto json = toJson(report);
  EXPECT_EQ(json["topics"]["/cmd_vel"]["not_played"], "body is not asked for");
  EXPECT_EQ(json["topics"]["/points"]["published"], 1);
  EXPECT_THROW(parseModalities("body,feet"), std::invalid_argument);
}

TEST_F(PlayerTest, reportsWhenEachMessageWasRecordedAndSent) {
  record(kCloud, 100, test::cloud(5));
  record(kCloud, 300, test::cloud(6));
  options.rate = 2;
  plan_options.start_s = 0.05;
  const PlayReport report = play(400);
  const std::vector<Sample>& moments = report.topics[0].second.moments.kept();
  ASSERT_EQ(moments.size(), 2u);
  EXPECT_NEAR(moments[0].recorded_s, 0.1, 1e-9);
  EXPECT_NEAR(moments[0].played_s, 0.025, 1e-6);
  EXPECT_NEAR(moments[1].recorded_s, 0.3, 1e-9);
  EXPECT_NEAR(moments[1].played_s, 0.125, 1e-6);
  const auto json = toJson(report);
  EXPECT_EQ(json["name"], "pick");
  EXPECT_EQ(json["begin_s"], 0.05);
  EXPECT_EQ(json["rate"], 2);
  EXPECT_EQ(json["in_step"]["gated"], true);
  EXPECT_EQ(json["in_step"]["waits"], 0);
  EXPECT_TRUE(json["dropped"].empty() && json["refused"].empty() && json["failures"].empty());
}

TEST_F(PlayerTest, saysWhenThereIsNothingToPlay) {
  record(kSay, 0, test::text("x"));
  EXPECT_EQ(play(10, "body").reason, "no topic of this behavior is to be played");
}

}  // namespace
}  // namespace afterglow::replay::player_test
