// Light and speech wait for the body at the recording's own milestones.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/player_world.hpp"

namespace afterglow::replay::player_in_step_test {
namespace {

using namespace test;
using PlayerInStep = PlayerWorld;

const std::string kCancels = "/arm/follow_joint_trajectory/cancel";

/// When the body had finished something, in the recording and in the replay, ms.
struct Reached {
  std::int64_t recorded, live;
};

/// The 95th percentile of how far messages were sent from where they were recorded relative to the
/// last milestone: told from the times of publishing alone.
std::int64_t skewP95(const Times& recorded, const Times& sent,
                     const std::vector<Reached>& milestones) {
  Times skews;
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    Reached last{0, 0};
    for (const Reached& milestone : milestones) {
      if (milestone.recorded <= recorded[i]) last = milestone;
    }
    skews.push_back(std::abs((sent.at(i) - last.live) - (recorded[i] - last.recorded)));
  }
  std::sort(skews.begin(), skews.end());
  return skews[skews.size() * 95 / 100];
}

// ---------------------------------------------------------------------------------------- in step

/// An arm that moves twice, with light and speech before, between and after.
struct TwoMoves : PlayerInStep {
  void SetUp() override {
    options.clear_projection = false;
    for (std::int64_t at = 0; at < 15'000; at += 110) recorded_light.push_back(at);
    record(kArm, 1000, goalMessage("a", {4.0}));
    for (const std::int64_t at : recorded_light) record(kMarkers, at, test::markers(1));
    for (const std::int64_t at : recorded_speech) record(kSay, at, test::text("x"));
    recordResult(kArm, 5000, "a");
    record(kArm, 5500, goalMessage("b", {7.0}));
    recordResult(kArm, 12'500, "b");
  }
  double measuredP95(const PlayReport& report, Modality modality) const {
    return static_cast<double>(report.in_step.skew.at(modality).size.quantile(0.95)) / kMs;
  }
  Times recorded_light, recorded_speech{500, 4000, 4990, 5100, 12'400, 12'510, 14'000};
};

TEST_F(TwoMoves, keepLightAndSpeechWithAnArmThatTakesThirtyPercentLonger) {
  actFor({5200, 9100});
  const PlayReport report = play(15'000);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_EQ(sink.times(kArm.topic), (Times{1000, 6700})) << "the second goal waits for the first";
  EXPECT_LE(skewP95(recorded_light, sink.times("/markers"), {{5000, 6200}, {12'500, 15'800}}), 20);
  EXPECT_EQ(sink.times("/robotsound"), (Times{500, 4000, 6200, 6300, 13'600, 15'810, 17'300}))
      << "what was said 10 ms before the result waits for it, too";
  EXPECT_TRUE(report.in_step.is_gated);
  EXPECT_LE(measuredP95(report, Modality::Ar), 20);
  ASSERT_EQ(report.in_step.waits.size(), 2u);
  EXPECT_NEAR(report.in_step.waits[0].recorded_s, 4.95, 1e-6);
  EXPECT_NEAR(report.in_step.waits[0].seconds, 1.2, 1e-6) << "30 % of 4 s";
  EXPECT_NEAR(report.in_step.waited_s, 3.3, 1e-6);
  EXPECT_EQ(report.in_step.waits[0].what, kArm.topic);
}

TEST_F(TwoMoves, areSecondsOffWithoutTheGate) {
  actFor({5200, 9100});
  options.is_in_step = false;
  const PlayReport report = play(15'000);
  EXPECT_EQ(sink.times("/markers"), recorded_light);
  EXPECT_GE(skewP95(recorded_light, sink.times("/markers"), {{5000, 6200}, {12'500, 14'600}}),
            2000);
  EXPECT_FALSE(report.in_step.is_gated);
  EXPECT_EQ(report.in_step.wait_count, 0u);
  EXPECT_GE(measuredP95(report, Modality::Ar), 2000 * 0.94) << "bins of 6 %";
}

TEST_F(TwoMoves, areNotHurriedByAFasterArm) {
  actFor({3000, 6000});
  const PlayReport report = play(15'000);
  EXPECT_EQ(sink.times("/markers"), recorded_light);
  EXPECT_EQ(sink.times("/robotsound"), recorded_speech);
  EXPECT_EQ(sink.times(kArm.topic), (Times{1000, 5500}));
  EXPECT_EQ(report.in_step.wait_count, 0u);
  EXPECT_EQ(report.actual_ns, 15'000 * kMs);
}

TEST_F(TwoMoves, tellWhenGoalsBeganAndEnded) {
  actFor({5200, 9100});
  const PlayReport report = play(15'000);
  ASSERT_EQ(report.goal_spans.size(), 2u);
  const GoalSpan& second = report.goal_spans[1];
  EXPECT_EQ(second.topic, kArm.topic);
  EXPECT_NEAR(second.recorded_begin_s, 5.5, 1e-6);
  EXPECT_NEAR(second.played_begin_s, 6.7, 1e-6);
  EXPECT_NEAR(second.recorded_end_s.value(), 12.5, 1e-6);
  EXPECT_NEAR(second.played_end_s.value(), 15.8, 1e-6);
  EXPECT_EQ(second.outcome, GoalOutcome::Succeeded);
}

TEST_F(TwoMoves, areInStepAtAnotherRate) {
  actFor({2600, 4550});
  options.rate = 2;
  play(15'000);
  EXPECT_EQ(sink.times(kArm.topic), (Times{500, 3350}));
  EXPECT_EQ(sink.times("/robotsound"), (Times{250, 2000, 3100, 3150, 6800, 7905, 8650}));
}

TEST_F(PlayerInStep, matchesResultsByIdOrElseByOrder) {
  record(kArm, 0, goalMessage("", {1.0}));
  record(kArm, 1000, goalMessage("", {1.0}));
  record(kSay, 900, test::text("x"));
  record(kSay, 2100, test::text("x"));
  recordResult(kArm, 800, "/server-1");
  recordResult(kArm, 900, "somebody else's");
  recordResult(kArm, 2000, "/server-2");
  actFor({1000, 1000});
  play(2500);
  EXPECT_EQ(sink.times(kArm.topic), (Times{0, 1200}));
  EXPECT_EQ(sink.times("/robotsound"), (Times{1100, 2300}))
      << "the second goal is over with the result that came next";
}

TEST_F(PlayerInStep, waitsForATrajectorysEndWhereNoResultsWereRecorded) {
  record(kArm, 0, goalMessage("a", {0.5, 1.0}));
  record(kSay, 1100, test::text("x"));
  actFor({1500});
  EXPECT_TRUE(play(2000).notes.empty());
  EXPECT_EQ(sink.times("/robotsound"), Times{1600});
}

TEST_F(PlayerInStep, saysThatNobodyKnowsWhenAGoalWasOver) {
  record(kGripper, 0, Bytes(28));
  record(kSay, 1100, test::text("x"));
  at(1500, [this] { player->onGoalStatus("fresh-1", 3); });
  const PlayReport report = play(2000);
  EXPECT_EQ(sink.times("/robotsound"), Times{1100});
  EXPECT_EQ(report.notes, std::vector<std::string>{
                              "no results of the goals on /gripper/goal were recorded: nothing "
                              "waits for them"});
}

TEST_F(PlayerInStep, doesNotWaitForAGoalThatTheNextOneEnds) {
  record(kArm, 0, goalMessage("a", {3.0}));
  record(kArm, 1000, goalMessage("b", {1.0}));
  recordResult(kArm, 1010, "a", 2);  // preempted
  recordResult(kArm, 2000, "b");
  at(1020, [this] { player->onGoalStatus("fresh-1", 2); });
  at(2000, [this] { player->onGoalStatus("fresh-2", 3); });
  EXPECT_TRUE(play(2500).is_complete);
  EXPECT_EQ(sink.times(kArm.topic), (Times{0, 1000}));
}

/// An action server that knows no preemption says so.
TEST_F(PlayerInStep, waitsForAGoalThatFailedButNotForOneThatFailedAsAnotherCame) {
  record(kArm, 0, goalMessage("a", {3.0}));
  record(kArm, 1000, goalMessage("b", {1.0}));
  recordResult(kArm, 1010, "a", 4);
  recordResult(kArm, 2000, "b", 4);
  play(2500);
  const Milestones milestones = Milestones::read(*store, plan);
  EXPECT_FALSE(milestones.of(kArm.topic, {kBegin}).value().is_awaited);
  EXPECT_TRUE(milestones.of(kArm.topic, {kBegin + 1000 * kMs}).value().is_awaited);
}

TEST_F(PlayerInStep, hasTheBaseStandWhileItWaits) {
  record(kArm, 0, goalMessage("a", {1.0}));
  for (int i = 0; i < 20; ++i) record(kCmdVel, i * 100, twist(1 + i));
  recordResult(kArm, 1000, "a");
  actFor({1500});
  play(2000);
  const std::vector<Sent> sent = sink.on("/cmd_vel");
  ASSERT_GT(sent.size(), 13u);
  EXPECT_EQ(sent[9].at_ms, 900);
  EXPECT_EQ(sent[10].at_ms, 1000) << "after 50 ms, which the leap makes good";
  EXPECT_EQ(sent[10].bytes, twist(0));
  EXPECT_EQ(sent[11].at_ms, 1500);
  EXPECT_EQ(sent[11].bytes, twist(10)) << "in force again";
  EXPECT_EQ(sent[12].at_ms, 1500);
  EXPECT_EQ(sent[12].bytes, twist(11)) << "recorded as the result was";
  EXPECT_EQ(sent[13].at_ms, 1600);
}

// --------------------------------------------------------------------- commands while it waits

/// An arm of 1 s that takes longer, held from 950 ms on.
struct Held : PlayerInStep {
  void SetUp() override {
    options.clear_projection = false;
    record(kCmdVel, 900, twist(1));
    record(kArm, 0, goalMessage("a", {0.5, 1.0}));
    record(kSay, 1100, test::text("x"));
    record(kSay, 3000, test::text("y"));
    recordResult(kArm, 1000, "a");
  }
};

TEST_F(Held, isPausedAndResumedAndGoesOnWaiting) {
  at(1200, [this] { player->pause(); });
  at(2200, [this] { player->resume(); });
  at(4200, [this] { player->onGoalStatus("fresh-2", 3); });
  const PlayReport report = play(3500);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_EQ(sink.times(kCancels), Times{1200});
  EXPECT_EQ(sink.times(kArm.topic), (Times{0, 2200}));
  EXPECT_EQ(timesFromStart(sink.on(kArm.topic)[1].bytes), std::vector<double>{5.05})
      << "it is late, and gets time for the rest";
  EXPECT_EQ(sink.times("/robotsound"), (Times{4300, 6200}));
  const std::vector<Sent> driven = sink.on("/cmd_vel");
  EXPECT_EQ(sink.times("/cmd_vel"), (Times{900, 1000, 1200, 4200, 6700, 6700}));
  EXPECT_EQ(driven[3].bytes, twist(1)) << "in force again only when the wait is over";
}

TEST_F(Held, isSoughtAwayFromTheWait) {
  at(1500, [this] { player->seek({2'500'000'000}); });
  at(3000, [this] { player->onGoalStatus("fresh-2", 3); });
  options.seek_lead_s = 1;
  const PlayReport report = play(3500);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_EQ(sink.times("/robotsound"), Times{3000});
}

TEST_F(Held, followsARateAndGoesOnWaiting) {
  at(1500, [this] { player->setRate(2); });
  at(2500, [this] { player->onGoalStatus("fresh-2", 3); });
  play(3500);
  EXPECT_EQ(sink.times("/robotsound"), (Times{2550, 3500}));
}

TEST_F(Held, isStoppedAtOnce) {
  at(1500, [this] { player->stop("enough"); });
  const PlayReport report = play(3500);
  EXPECT_EQ(report.reason, "enough");
  EXPECT_EQ(sink.times(kCancels), Times{1500});
  EXPECT_TRUE(sink.on("/robotsound").empty());
}

TEST_F(Held, endsWhenTheArmTakesTooLong) {
  options.goal_wait_s = 2;
  const PlayReport report = play(3500);
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(report.reason, "body failed: a goal on " + kArm.topic +
                               " took 2 s longer than it did when it was recorded");
  EXPECT_EQ(sink.times(kCancels), Times{3000});
  EXPECT_EQ(report.failures.at(Modality::Body).count, 1u);
  EXPECT_NEAR(report.in_step.waited_s, 2.05, 1e-6);
}

TEST_F(Held, goesOnWithoutTheArmIfThatIsThePolicy) {
  options.goal_wait_s = 2;
  options.on_failure = parseOnFailure({"body=go_on"});
  at(4000, [this] { player->onGoalStatus("fresh-1", 3); });
  const PlayReport report = play(3500);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_EQ(sink.times("/robotsound"), (Times{3150, 5050}));
}

TEST_F(PlayerInStep, isPausedWhileItWaitsForTheLastGoal) {
  options.goal_wait_s = 2;
  record(kArm, 0, goalMessage("a", {1.0}));
  at(700, [this] { player->pause(); });
  at(5700, [this] { player->resume(); });
  at(6500, [this] { player->onGoalStatus("fresh-2", 3); });
  const PlayReport report = play(500);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_EQ(report.goals.succeeded, 1u);
  EXPECT_EQ(sink.times(kArm.topic), (Times{0, 5700}));
}

// ------------------------------------------------------------------------------- recorded cancels

struct Canceled : PlayerInStep {
  Canceled() {
    record(kArm, 1000, goalMessage("a", {4.0}));
    actFor({1600}, 2);  // PREEMPTED
  }
  /// The recorder keeps it beside the goals.
  void recordCancel(std::int64_t at_ms, const std::string& id) {
    const std::vector<std::string> own = topics;
    record(cancelChannel(kArm), at_ms, cancelMessage(id));
    topics = own;
  }
  void expectCancels(const PlayReport& report, const Times& times) {
    EXPECT_TRUE(report.is_complete) << report.reason;
    EXPECT_EQ(sink.times(kCancels), times);
    for (const Sent& cancel : sink.on(kCancels)) EXPECT_EQ(cancel.bytes, cancelMessage("fresh-1"));
    EXPECT_EQ(report.goals.canceled, 1u);
  }
};

TEST_F(Canceled, goalsAreCanceledAtTheirMomentByTheirFreshId) {
  recordCancel(2500, "a");
  expectCancels(play(4000), {2500});
}

TEST_F(Canceled, goalsAreTheOnlyOnesThatACancelOfEverybodysReaches) {
  recordCancel(2500, "");
  expectCancels(play(4000), {2500});
}

TEST_F(Canceled, goalsAreCanceledWhenTheirResultCameIfTheCancelWasNotRecorded) {
  actFor({});
  recordResult(kArm, 2700, "a", 2);
  expectCancels(play(4000), {2700});
}

TEST_F(Canceled, goalsThatAnotherGoalReplacedNeedNoCancel) {
  record(kArm, 2500, goalMessage("b", {1.0}));
  recordResult(kArm, 2600, "a", 2);
  recordResult(kArm, 3600, "b");
  sink.on_publish = [this](const Sent& sent) {
    if (sent.topic != kArm.topic) return;
    const bool is_second = goalId(sent.bytes) == "fresh-2";
    if (is_second) player->onGoalStatus("fresh-1", 2);
    if (is_second) clock.at(clock.now().after(1000 * kMs), [this] {
      player->onGoalStatus("fresh-2", 3);
    });
  };
  EXPECT_TRUE(play(4000).is_complete);
  EXPECT_TRUE(sink.on(kCancels).empty());
}

TEST_F(Canceled, goalsAreNotInForceAfterTheirCancel) {
  recordCancel(2500, "a");
  plan_options.start_s = 3;
  EXPECT_TRUE(play(4000).is_complete);
  EXPECT_TRUE(sink.on(kArm.topic).empty());
}

TEST_F(Canceled, goalsAreNotInForceAfterTheResultOfACancelThatWasNotRecorded) {
  recordResult(kArm, 2700, "a", 2);
  plan_options.start_s = 3;
  EXPECT_TRUE(play(4000).is_complete);
  EXPECT_TRUE(sink.on(kArm.topic).empty());
}

TEST_F(Canceled, goalsThatAreNotPlayedAreNotCanceled) {
  record(cancelChannel(kArm), 2500, cancelMessage("a"));
  record(kSay, 3000, test::text("x"));
  plan_options.exclude = {kArm.topic};
  EXPECT_TRUE(play(4000).is_complete);
  EXPECT_TRUE(sink.on(kCancels).empty());
}

// -------------------------------------------------------------------------------------------- skew

constexpr Stamp recordedAt(std::int64_t ms) { return {ms * kMs}; }
constexpr SteadyTime liveAt(std::int64_t ms) { return {ms * kMs}; }

/// ms, in the order they were measured.
std::vector<double> skews(const Skew& skew) {
  std::vector<double> found;
  const auto measured = skew.measured().find(Modality::Ar);
  if (measured == skew.measured().end()) return found;
  for (const Sample& sample : measured->second.samples.kept()) found.push_back(sample.value);
  return found;
}

TEST(Skew, isMeasuredFromTheLastMilestoneThatWasRecordedByThen) {
  Skew skew;
  skew.begin(recordedAt(0), liveAt(0));
  skew.add(Modality::Ar, recordedAt(50), liveAt(80), 1);
  EXPECT_TRUE(skews(skew).empty()) << "before the first";
  skew.reach(recordedAt(1000), liveAt(1300));
  skew.reach(recordedAt(2000), liveAt(2900));
  skew.add(Modality::Ar, recordedAt(1500), liveAt(3000), 1);
  skew.add(Modality::Ar, recordedAt(1990), liveAt(2900), 1);
  skew.add(Modality::Ar, recordedAt(2400), liveAt(3095), 2);
  EXPECT_EQ(skews(skew), (std::vector<double>{1200, 10, -5}));
  EXPECT_EQ(skew.measured().at(Modality::Ar).size.max(), 1200 * kMs);
}

TEST(Skew, isMeasuredOfWhatRanAheadOnceTheBodyIsThere) {
  Skew skew;
  skew.begin(recordedAt(0), liveAt(0));
  skew.reach(recordedAt(500), liveAt(500));
  skew.expect(recordedAt(1000));
  skew.add(Modality::Ar, recordedAt(900), liveAt(900), 1);
  skew.add(Modality::Ar, recordedAt(1100), liveAt(1100), 1);
  EXPECT_EQ(skews(skew), std::vector<double>{0});
  skew.reach(recordedAt(1000), liveAt(3000));
  EXPECT_EQ(skews(skew), (std::vector<double>{0, -2000}));
  skew.restart();
  skew.add(Modality::Ar, recordedAt(1200), liveAt(9000), 1);
  EXPECT_EQ(skews(skew).size(), 2u) << "a pause is no skew";
}

TEST(RecentWorst, isThatOfTheLastHalfToWholeSecond) {
  RecentWorst worst;
  EXPECT_FALSE(worst.at(liveAt(0)));
  worst.add(liveAt(0), 0);
  EXPECT_EQ(worst.at(liveAt(1)), 0);
  worst.add(liveAt(100), 70);
  worst.add(liveAt(400), 30);
  EXPECT_EQ(worst.at(liveAt(400)), 70);
  worst.add(liveAt(600), 20);
  EXPECT_EQ(worst.at(liveAt(900)), 70);
  worst.add(liveAt(1200), 10);
  EXPECT_EQ(worst.at(liveAt(1300)), 20);
  EXPECT_EQ(worst.at(liveAt(1900)), 10);
  EXPECT_FALSE(worst.at(liveAt(2300))) << "nothing came for a second";
  worst.add(liveAt(9000), 5);
  EXPECT_EQ(worst.at(liveAt(9000)), 5);
}

}  // namespace
}  // namespace afterglow::replay::player_in_step_test
