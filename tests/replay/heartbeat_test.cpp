#include "replay/motion/stops/heartbeat.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <thread>

#include "replay/clock/clock.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/motion/stops/motion_monitor.hpp"
#include "tests/support/jumping_clock.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::replay::heartbeat_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr SteadyTime kStart{1'000'000 * kMs};

SteadyTime at(std::int64_t ms) { return kStart.after(ms * kMs); }

/// Steps whenever it asks to be, and says when it stopped something.
std::vector<std::int64_t> brakes(HeartbeatMonitor& watch, std::int64_t until_ms) {
  std::vector<std::int64_t> times;
  while (!watch.isOver() && watch.deadline() <= at(until_ms)) {
    const SteadyTime now = watch.deadline();
    if (!watch.step(now).empty()) times.push_back((now.ns - kStart.ns) / kMs);
  }
  return times;
}

TEST(HeartbeatMonitor, letsAPlayerThatBeatsMoveTheRobot) {
  HeartbeatMonitor watch({});
  for (std::int64_t ms = 0; ms < 1000; ms += 20) {
    watch.beat(at(ms), {1}, at(ms));
    EXPECT_TRUE(watch.step(at(ms + 19)).empty());
  }
  watch.end();
  EXPECT_TRUE(watch.isOver());
  EXPECT_EQ(watch.reason(), "");
}

TEST(HeartbeatMonitor, brakesWithinAHundredMillisecondsOfTheLastBeatAndForAWhile) {
  HeartbeatMonitor watch({});
  watch.beat(at(0), {1, 4}, at(0));
  const std::vector<std::int64_t> times = brakes(watch, 10'000);
  ASSERT_GT(times.size(), 10u) << "one may be lost";
  EXPECT_EQ(times.front(), 60);
  EXPECT_EQ(times.back(), 360) << "300 ms later";
  EXPECT_TRUE(watch.isOver());
  EXPECT_EQ(watch.reason(), "the player was silent for more than 60 ms in motion "
            "(--longest-stall, ~longest_stall allows more)");
}

TEST(HeartbeatMonitor, namesWhatIsInMotionAndNothingElse) {
  HeartbeatMonitor watch({});
  watch.beat(at(0), {1, 2}, at(0));
  watch.beat(at(20), {2}, at(20));
  EXPECT_EQ(watch.step(at(80)), Outputs{2});
}

TEST(HeartbeatMonitor, brakesAtOnceWhenThePlayerIsGone) {
  HeartbeatMonitor watch({});
  watch.beat(at(0), {3}, at(0));
  watch.stop(at(7), "the player is gone");
  EXPECT_EQ(watch.step(at(7)), Outputs{3});
  watch.beat(at(8), {}, at(8));
  EXPECT_EQ(watch.step(watch.deadline()), Outputs{3}) << "too late to say that all is well";
  brakes(watch, 10'000);
  EXPECT_TRUE(watch.isOver());
}

TEST(HeartbeatMonitor, mindsNoSilenceWhileTheRobotStands) {
  HeartbeatMonitor watch({});
  watch.beat(at(0), {1}, at(0));
  watch.beat(at(20), {}, at(20));
  EXPECT_EQ(watch.deadline(), SteadyTime::forever());
  EXPECT_TRUE(watch.step(at(100'000)).empty());
  watch.stop(at(100'000), "the player is gone");
  EXPECT_TRUE(watch.isOver()) << "there is nothing to stop";
}

TEST(HeartbeatMonitor, bearsALostBeat) {
  HeartbeatMonitor watch({});
  for (const std::int64_t ms : {0, 20, 60, 80, 120}) {  // those at 40 and 100 were lost
    EXPECT_TRUE(watch.step(at(ms)).empty());
    watch.beat(at(ms), {1}, at(ms));
  }
  EXPECT_EQ(watch.reason(), "");
}

TEST(HeartbeatMonitor, waitsAsLongAsItIsTold) {
  HeartbeatMonitor watch({});
  watch.setLongestSilence(150 * kMs);
  watch.beat(at(0), {1}, at(0));
  EXPECT_TRUE(watch.step(at(149)).empty());
  EXPECT_EQ(watch.step(at(150)), Outputs{1});
  EXPECT_EQ(watch.reason(), "the player was silent for more than 150 ms in motion "
            "(--longest-stall, ~longest_stall allows more)");
}

TEST(HeartbeatMonitor, brakesAPlayerThatSleptThoughItSleptItself) {
  HeartbeatMonitor watch({});
  watch.beat(at(0), {1}, at(5000));
  watch.beat(at(1), {2}, at(8000));  // the first that is heard after waking
  EXPECT_EQ(watch.step(at(1)), (Outputs{1, 2}));
  EXPECT_EQ(watch.reason(), "the player was silent for more than 60 ms in motion "
            "(--longest-stall, ~longest_stall allows more)");
}

TEST(HeartbeatMonitor, isNotAlarmedByBeatsThatWereHeardLateButSentInTime) {
  HeartbeatMonitor watch({});
  watch.beat(at(0), {1}, at(0));
  for (const std::int64_t ms : {20, 40, 60, 80}) watch.beat(at(90), {1}, at(ms));
  EXPECT_TRUE(watch.step(at(90)).empty()) << "it hung, the player did not";
}

TEST(HeartbeatMonitor, mindsNoSleepWhileTheRobotStands) {
  HeartbeatMonitor watch({});
  watch.beat(at(0), {}, at(0));
  watch.beat(at(1), {1}, at(60'000));
  EXPECT_TRUE(watch.step(at(1)).empty());
}

TEST(HeartbeatMonitor, brakesAgainWhenAPlayerComesBackAndMoves) {
  HeartbeatMonitor watch({});
  watch.beat(at(0), {1}, at(0));
  brakes(watch, 10'000);
  ASSERT_TRUE(watch.isOver());
  watch.beat(at(20'000), {}, at(20'000));
  EXPECT_TRUE(watch.isOver());
  watch.beat(at(20'020), {2}, at(20'020));
  EXPECT_EQ(watch.step(at(20'020)), Outputs{2});
  EXPECT_GE(brakes(watch, 30'000).back(), 20'320);
  EXPECT_TRUE(watch.isOver());
}

TEST(HeartbeatMonitor, neverWatchesAPlayerAgainThatHasEnded) {
  HeartbeatMonitor watch({});
  watch.beat(at(0), {1}, at(0));
  watch.end();
  watch.beat(at(20), {1}, at(20));
  EXPECT_TRUE(watch.isOver());
  EXPECT_EQ(watch.deadline(), SteadyTime::forever());
}

TEST(BeatingClock, beatsWhenItIsTimeAndKeepsTheDeadline) {
  JumpingClock inner;
  std::vector<std::int64_t> beats;
  const SteadyTime start = inner.now();
  BeatingClock clock(inner, [&] { beats.push_back((inner.now().ns - start.ns) / kMs); });
  for (const std::int64_t ms : {20, 40}) inner.at(start.after(ms * kMs), [&] { clock.tick(); });
  EXPECT_TRUE(clock.sleepUntil(start.after(50 * kMs)));
  EXPECT_EQ(clock.now(), start.after(50 * kMs));
  EXPECT_EQ(beats, (std::vector<std::int64_t>{0, 20, 40}));
  inner.at(start.after(75 * kMs), [&] { clock.wake(); });
  EXPECT_FALSE(clock.sleepUntil(SteadyTime::forever()));
  EXPECT_EQ(clock.now(), start.after(75 * kMs));
}

TEST(BeatingClock, givesNoSignOfLifeForAnotherThread) {
  JumpingClock inner;
  int beats = 0;
  BeatingClock clock(inner, [&] { ++beats; });
  clock.sleepUntil(inner.now());
  clock.tick();
  std::thread([&] { clock.beatIfDue(); }).join();
  EXPECT_EQ(beats, 1);
  clock.beatIfDue();
  EXPECT_EQ(beats, 2);
}

// ------------------------------------------------------------------------------- what is in motion

struct MotionWatching : testing::Test {
  MotionWatching() {
    PlayPlan plan;
    for (const Channel& channel : {drive, arm, command, light}) {
      PlannedTopic topic;
      topic.channel = topic.output = channel;
      plan.topics.push_back(topic);
    }
    watch = std::make_unique<MotionMonitor>(plan);
  }
  Bytes trajectory(std::uint8_t points) const {
    Value message = test::blank(command);
    const Value point =
        test::blank(test::schemaOf(command), "trajectory_msgs/JointTrajectoryPoint");
    test::at(message, "points") = Array(points, point);
    return encode(test::schemaOf(command), message);
  }

  Channel drive = test::twistChannel("/cmd_vel");
  Channel arm = test::trajectoryGoalChannel("/arm/goal");
  Channel command =
      test::channelOf("/command", "trajectory_msgs/JointTrajectory", test::kBareTrajectory);
  Channel light = test::cloudChannel("/points");
  std::unique_ptr<MotionMonitor> watch;
};

TEST_F(MotionWatching, knowsWhatStopsEachOutput) {
  ASSERT_EQ(watch->outputs().size(), 3u);
  EXPECT_EQ(watch->outputs()[0].stop, test::twist(0));
  EXPECT_EQ(watch->outputs()[1].channel.topic, "/arm/cancel");
  EXPECT_EQ(watch->outputs()[1].stop, cancelMessage(""));
  EXPECT_EQ(watch->outputs()[2].channel.topic, "/command");
}

TEST_F(MotionWatching, seesVelocitiesBeginAndEnd) {
  EXPECT_TRUE(watch->sending(drive, test::twist(0.2)).is_motion);
  EXPECT_EQ(watch->moving(), Outputs{0});
  EXPECT_FALSE(watch->sending(drive, test::twist(0.3)).has_changed);
  const MotionMonitor::Change change = watch->sending(drive, test::twist(0));
  EXPECT_FALSE(change.is_motion);
  EXPECT_TRUE(change.has_changed);
  EXPECT_TRUE(watch->moving().empty());
  EXPECT_FALSE(watch->sending(drive, test::twist(0)).has_changed) << "it stood";
}

TEST_F(MotionWatching, seesAnActionMoveUntilItsLastGoalIsOver) {
  watch->sending(arm, test::goalMessage("a", {1}));
  watch->sending(arm, test::goalMessage("b", {1}));
  EXPECT_FALSE(watch->goalEnded("somebody else's").has_changed);
  EXPECT_FALSE(watch->goalEnded("a").has_changed);
  EXPECT_EQ(watch->moving(), Outputs{1});
  EXPECT_TRUE(watch->sending(cancelChannel(arm), cancelMessage("b")).has_changed);
  EXPECT_TRUE(watch->moving().empty());
  EXPECT_FALSE(watch->sending(cancelChannel(arm), cancelMessage("b")).has_changed);
}

TEST_F(MotionWatching, takesACancelThatIsCutOffForOneOfAllGoals) {
  watch->sending(arm, test::goalMessage("a", {1}));
  watch->sending(arm, test::goalMessage("b", {1}));
  EXPECT_TRUE(watch->sending(cancelChannel(arm), Bytes(10)).has_changed);
  EXPECT_TRUE(watch->moving().empty());
}

TEST_F(MotionWatching, haltsATrajectoryCommandByItsOwnJoints) {
  const MotionMonitor::Change change = watch->sending(command, trajectory(2));
  EXPECT_TRUE(change.is_motion);
  EXPECT_EQ(watch->outputs()[2].stop, trajectory(0));
  EXPECT_FALSE(watch->sending(command, trajectory(3)).has_other_stop) << "the same joints";
  EXPECT_FALSE(watch->sending(command, trajectory(0)).is_motion);
  EXPECT_TRUE(watch->moving().empty());
}

TEST_F(MotionWatching, leavesLightAlone) {
  EXPECT_FALSE(watch->sending(light, test::cloud(3)).is_motion);
  EXPECT_TRUE(watch->moving().empty());
}

}  // namespace
}  // namespace afterglow::replay::heartbeat_test
