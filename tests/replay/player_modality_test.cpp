// What is set for the body, light and speech one by one: latency, and what becomes of a replay when
// one fails.
#include <gtest/gtest.h>

#include "tests/support/player_world.hpp"

namespace afterglow::replay::player_modality_test {
namespace {

using namespace test;
using PlayerModality = PlayerWorld;

const std::string kCancels = "/arm/follow_joint_trajectory/cancel";

// ---------------------------------------------------------------------------------------- failures

struct Failing : PlayerModality {
  void SetUp() override {
    record(kArm, 0, goalMessage("a", {1.0}));
    record(kCloud, 0, test::cloud(5));
    record(kSay, 1100, test::text("x"));
  }
};

TEST_F(Failing, stopsAllAndClearsTheLightWhenAGoalIsAborted) {
  recordResult(kArm, 1000, "a");
  actFor({500}, 4);
  const PlayReport report = play(2000);
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(report.reason, "body failed: a goal on " + kArm.topic +
                               " was aborted, and was not when it was recorded");
  EXPECT_EQ(sink.times("/points"), (Times{0, 500}));
  EXPECT_EQ(test::cloudWidth(sink.on("/points")[1].bytes), 0u);
  EXPECT_TRUE(sink.on("/robotsound").empty());
}

TEST_F(Failing, stopsAllWhenSomebodyElseCancelsTheGoal) {
  recordResult(kArm, 1000, "a");
  actFor({500}, 2);
  const PlayReport report = play(2000);
  EXPECT_EQ(report.reason, "body failed: a goal on " + kArm.topic +
                               " was canceled, and was not when it was recorded");
  EXPECT_TRUE(sink.on("/robotsound").empty());
}

TEST_F(Failing, goesOnWhenAGoalFailsAsItDidThen) {
  recordResult(kArm, 1000, "a", 4);
  actFor({500}, 4);
  const PlayReport report = play(2000);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_EQ(sink.times("/robotsound"), Times{1100});
  EXPECT_TRUE(report.failures.empty());
}

TEST_F(Failing, goesOnWithoutLightAndSpeechUnlessItIsToStop) {
  recordResult(kArm, 1000, "a");
  actFor({1000});
  sink.is_heard_on["/robotsound"] = false;
  const PlayReport report = play(2000);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_EQ(report.failures.at(Modality::Speech).first, "nobody listened on /robotsound");
  sink.sent.clear();
  clock = JumpingClock();
  options.on_failure = parseOnFailure({"speech=stop,ar=go_on"});
  ids = 0;
  actFor({1000});
  EXPECT_EQ(play(2000).reason, "speech failed: nobody listened on /robotsound");
  EXPECT_EQ(sink.times("/points"), (Times{0, 1100})) << "the light is cleared";
}

TEST_F(Failing, isToldOfASpeakerThatCannotSpeak) {
  recordResult(kArm, 1000, "a");
  options.on_failure = parseOnFailure({"speech=stop"});
  at(300, [this] { player->fail(Modality::Speech, "no voice"); });
  const PlayReport report = play(2000);
  EXPECT_EQ(report.reason, "speech failed: no voice");
  EXPECT_EQ(sink.times(kCancels), Times{300});
}

TEST(ModalityOptions, areReadAndRefused) {
  EXPECT_EQ(parseLatency({"ar=0.05,speech=0.2"}).at(Modality::Speech), 0.2);
  EXPECT_EQ(parseLatency({"ar=0.05", "ar=0.1"}).at(Modality::Ar), 0.1);
  EXPECT_TRUE(parseLatency({}).empty());
  for (const char* wrong : {"ar", "feet=1", "ar=", "ar=x", "ar=-1", "ar=6", "ar=nan"}) {
    EXPECT_THROW(parseLatency({wrong}), std::invalid_argument) << wrong;
  }
  EXPECT_THROW(parseOnFailure({"ar=perhaps"}), std::invalid_argument);
  EXPECT_EQ(policyOf({}, Modality::Body), OnFailure::Stop);
  EXPECT_EQ(policyOf({}, Modality::Speech), OnFailure::GoOn);
}

// ----------------------------------------------------------------------------------------- latency

TEST_F(PlayerModality, sendsWhatIsSlowToBeSeenOrHeardEarlier) {
  for (const std::int64_t at : {0, 300, 600}) {
    record(kMarkers, at, test::markers(1));
    record(kSay, at, test::text("x"));
    record(kCmdVel, at, twist(1));
  }
  options.latency_s = parseLatency({"ar=0.05,speech=0.2"});
  options.clear_projection = false;
  const PlayReport report = play(1000);
  EXPECT_EQ(sink.times("/robotsound"), (Times{0, 300, 600})) << "0.2 s before the base, and first";
  EXPECT_EQ(sink.times("/markers"), (Times{150, 450, 750}));
  EXPECT_EQ(sink.times("/cmd_vel"), (Times{200, 500, 800, 1200, 1200}));
  for (const auto& [planned, topic] : report.topics) EXPECT_EQ(topic.lateness.max(), 0);
}

TEST_F(PlayerModality, neverSendsEarlyWhatHasToWait) {
  options.latency_s = parseLatency({"speech=0.2"});
  record(kArm, 0, goalMessage("a", {1.0}));
  for (const std::int64_t at : {500, 800, 1050, 1500}) record(kSay, at, test::text("x"));
  for (int i = 0; i < 11; ++i) record(kCmdVel, i * 90, twist(1));
  recordResult(kArm, 1000, "a");
  actFor({1300});
  const PlayReport report = play(2000);
  EXPECT_EQ(sink.times("/robotsound"), (Times{500, 800, 1500, 1800}))
      << "from the first deadline on, which comes 200 ms later: 1050 at once, 1500 less 200";
  const Times driven = sink.times("/cmd_vel");
  EXPECT_EQ(driven.at(10), 200 + 900) << "and keeps nothing else back";
  for (const auto& [planned, topic] : report.topics) EXPECT_EQ(topic.lateness.max(), 0);
}

TEST_F(PlayerModality, doesNotTakeForStalledWhatHadToWait) {
  options.latency_s = parseLatency({"body=2"});
  record(kArm, 0, goalMessage("a", {1.0}));
  recordResult(kArm, 1000, "a");
  record(kArm, 1100, goalMessage("b", {1.0}));
  recordResult(kArm, 2100, "b");
  actFor({4000, 1000});
  const PlayReport report = play(2500);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_EQ(sink.times(kArm.topic), (Times{0, 4000}));
}

TEST_F(PlayerModality, keepsALatencyInRealTimeWhenTheRateChanges) {
  for (const std::int64_t at : {0, 1000, 3000}) record(kSay, at, test::text("x"));
  for (const std::int64_t at : {0, 1000, 3000}) record(kMarkers, at, test::markers(1));
  options.latency_s = parseLatency({"speech=0.2"});
  options.clear_projection = false;
  at(1700, [this] { player->setRate(2); });
  play(3500);
  EXPECT_EQ(sink.times("/markers"), (Times{200, 1200, 2450}));
  EXPECT_EQ(sink.times("/robotsound"), (Times{0, 1000, 2250}));
}

}  // namespace
}  // namespace afterglow::replay::player_modality_test
