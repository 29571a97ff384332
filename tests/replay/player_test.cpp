#include "replay/play/player.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "replay/messages/document.hpp"
#include "tests/support/faulty_store.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::replay {
namespace {

using test::goalMessage;
using test::twist;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kBegin = 1'600'000'000'000'000'000;

const Channel kCmdVel = test::twistChannel("/cmd_vel");
const Channel kArm = test::trajectoryGoalChannel("/arm/follow_joint_trajectory/goal");
const Channel kCloud = test::cloudChannel("/points");
const Channel kMarkers = test::markersChannel("/markers");
const Channel kSay = test::stringChannel("/robotsound");

struct Sent {
  std::int64_t at_ms;  ///< since the first deadline
  std::string topic;
  Bytes bytes;
};

/// Remembers what was sent and when; may fail, and may act like a slow network.
class SpySink : public MessageSink {
 public:
  explicit SpySink(JumpingClock& clock) : clock_(clock), start_(clock.now().after(5 * kMs)) {}
  bool publish(const Channel& channel, const Bytes& bytes) override {
    sent.push_back({(clock_.now().ns - start_.ns) / kMs, channel.topic, bytes});
    if (on_publish) on_publish(sent.back());
    return is_heard;
  }
  std::vector<Sent> on(const std::string& topic) const {
    std::vector<Sent> found;
    for (const Sent& message : sent) {
      if (message.topic == topic) found.push_back(message);
    }
    return found;
  }
  std::vector<std::int64_t> times(const std::string& topic) const {
    std::vector<std::int64_t> found;
    for (const Sent& message : on(topic)) found.push_back(message.at_ms);
    return found;
  }

  std::vector<Sent> sent;
  bool is_heard = true;
  std::function<void(const Sent&)> on_publish;

 private:
  JumpingClock& clock_;
  SteadyTime start_;
};

struct PlayerTest : testing::Test {
  void record(const Channel& channel, std::int64_t at_ms, Bytes bytes) {
    Message message;
    message.channel = store->addChannel(recording, channel);
    message.received = {kBegin + at_ms * kMs};
    message.sequence = sequence++;
    message.bytes = std::move(bytes);
    store->append({message});
    if (std::find(topics.begin(), topics.end(), channel.topic) == topics.end()) {
      topics.push_back(channel.topic);
    }
  }

  PlayReport play(
      std::int64_t length_ms, const std::string& only = "",
      const std::function<void()>& once_planned = [] {}) {
    Behavior behavior;
    behavior.recording = recording;
    behavior.name = "pick";
    behavior.begin = {kBegin};
    behavior.end = Stamp{kBegin + length_ms * kMs};
    behavior.topics = topics;
    behavior.id = store->addBehavior(behavior);
    plan = makePlan(*store, behavior, parseModalities(only));
    once_planned();
    // ROS time is read a little later each time, as on a machine with other things to do.
    const auto ros_now = [this] { return Stamp{clock.now().ns + kBegin * 2 + 1000 * ++asked}; };
    player = std::make_unique<Player>(*store, plan, options, sink, clock, ros_now,
                                      [this] { return "fresh-" + std::to_string(++ids); });
    return player->run();
  }

  /// At a moment of the replay.
  void at(std::int64_t ms, std::function<void()> hook) {
    clock.at(clock.now().after((ms + 5) * kMs), std::move(hook));
  }

  std::unique_ptr<test::FaultyStore> store = std::make_unique<test::FaultyStore>();
  std::int64_t recording = store->addRecording({0, "", "test", ""});
  std::uint64_t sequence = 0;
  std::vector<std::string> topics;
  JumpingClock clock;
  SpySink sink{clock};
  PlayOptions options;
  PlayPlan plan;
  std::unique_ptr<Player> player;
  int ids = 0, asked = 0;
};

using Times = std::vector<std::int64_t>;

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
  EXPECT_EQ(sink.times("/cmd_vel"), (Times{0, 100, 200, 250, 1300, 1400, 1450, 1450}));
  EXPECT_EQ(sent[3].bytes, twist(0)) << "on the pause";
  EXPECT_EQ(sent[4].bytes, twist(0.5));
  EXPECT_EQ(sent.back().bytes, twist(0)) << "at the end";
  EXPECT_TRUE(report.is_complete);
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
  EXPECT_EQ(report.topics.at(0).second.problem, "a velocity that is no number");
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

TEST_F(PlayerTest, saysWhenThereIsNothingToPlay) {
  record(kSay, 0, test::text("x"));
  EXPECT_EQ(play(10, "body").reason, "no topic of this behavior is to be played");
}

}  // namespace
}  // namespace afterglow::replay
