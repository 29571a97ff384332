// A replay whose goals begin where the arm is.
#include <gtest/gtest.h>

#include "replay/messages/document.hpp"
#include "replay/motion/arm/arm_start.hpp"
#include "tests/support/player_world.hpp"

namespace afterglow::replay::player_arm_test {
namespace {

using namespace test;
using Times = std::vector<std::int64_t>;

Bytes elbowGoal(const std::string& id, const std::vector<std::pair<double, double>>& points) {
  std::vector<double> times;
  for (const auto& [time, position] : points) times.push_back(time);
  const Schema schema = schemaOf(kArm);
  Value goal = decode(schema, goalMessage(id, times));
  test::at(goal, "goal.trajectory.joint_names") = Array{std::string("elbow")};
  Array& array = std::get<Array>(test::at(goal, "goal.trajectory.points"));
  for (std::size_t i = 0; i < points.size(); ++i) {
    valueAt(array[i], "positions") = numberArray({points[i].second});
  }
  return encode(schema, goal);
}

double firstPosition(const Bytes& goal) {
  Value document = decode(schemaOf(kArm), goal);
  return numbersAt(trajectoryIn(document)->points->front(), "positions").at(0);
}

/// An elbow that was recorded going from 0 to 2 rad in 4 s, and stood then.
struct PlayerArm : PlayerWorld {
  PlayerArm() {
    record(kArm, 0, elbowGoal("a", {{1, 0.5}, {4, 2}}));
    for (int ms = -100; ms <= 10'000; ms += 20) {
      track.add("elbow", {kBegin + ms * kMs}, std::clamp(ms / 2000.0, 0.0, 2.0));
    }
  }
  PlayReport playArm(std::int64_t length_ms) {
    start.emplace(
        track,
        [this](const std::string&) {
          return is_told ? std::optional(LiveJoint{elbow, 0}) : std::nullopt;
        },
        arm_options);
    options.arm_start = &*start;
    return play(length_ms);
  }

  JointTrack track;
  ArmStartOptions arm_options;
  std::optional<ArmStart> start;
  double elbow = 0;  ///< where it is
  bool is_told = true;
};

TEST_F(PlayerArm, beginsGoalsWhereTheArmIs) {
  actFor({4000});
  elbow = 0.01;
  EXPECT_TRUE(playArm(5000).is_complete);
  const auto goals = sink.on(kArm.topic);
  ASSERT_EQ(goals.size(), 1u);
  EXPECT_EQ(timesFromStart(goals[0].bytes), (std::vector<double>{0, 1, 4}));
  EXPECT_EQ(firstPosition(goals[0].bytes), 0.01);
}

TEST_F(PlayerArm, goesOnAfterAPauseFromWhereTheArmIsHeld) {
  elbow = 0;
  at(2000, [this] {
    elbow = 1.02;
    player->pause();
  });
  at(12'000, [this] { player->resume(); });
  at(14'000, [this] { player->onGoalStatus("fresh-2", 3); });
  EXPECT_TRUE(playArm(5000).is_complete);
  const auto goals = sink.on(kArm.topic);
  ASSERT_EQ(goals.size(), 2u);
  EXPECT_EQ(goals[1].at_ms, 12'000);
  EXPECT_NEAR(firstPosition(goals[1].bytes), 1.02, 1e-9);
  EXPECT_NEAR(timesFromStart(goals[1].bytes).back(), 1.96 + 0.375, 1e-6)
      << "from rest to 0.5 rad/s in 0.75 s";
}

TEST_F(PlayerArm, overtakesAGoalAtAnotherRateWhereControllersJoinAndCancelsItThen) {
  arm_options.controllers_join = true;
  at(2000, [this] {
    elbow = 1;
    player->setRate(0.5);
  });
  at(9000, [this] { player->onGoalStatus("fresh-2", 3); });
  EXPECT_TRUE(playArm(5000).is_complete);
  ASSERT_EQ(sink.sent.size(), 3u);
  EXPECT_EQ(sink.sent[1].topic, kArm.topic);
  EXPECT_EQ(sink.sent[2].topic, "/arm/follow_joint_trajectory/cancel");
  EXPECT_EQ(sink.sent[1].at_ms, 2000);
  EXPECT_EQ(sink.sent[2].at_ms, 2000);
}

TEST_F(PlayerArm, cancelsAGoalAtAnotherRateThatNothingMayOvertake) {
  arm_options.controllers_join = true;
  at(2000, [this] {
    is_told = false;
    player->setRate(0.5);
  });
  const PlayReport report = playArm(5000);
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(report.reason, "it does not go on: nobody tells where elbow is (/joint_states)");
  EXPECT_EQ(sink.on(kArm.topic).size(), 1u);
  const auto cancels = sink.on("/arm/follow_joint_trajectory/cancel");
  ASSERT_EQ(cancels.size(), 1u);
  EXPECT_EQ(cancels[0].at_ms, 2000);
}

TEST_F(PlayerArm, stopsWhenTheArmWasMovedInAPause) {
  at(2000, [this] {
    elbow = 1;
    player->pause();
  });
  at(5000, [this] { elbow = 0.2; });
  at(12'000, [this] { player->resume(); });
  const PlayReport report = playArm(5000);
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(sink.on(kArm.topic).size(), 1u);
  EXPECT_EQ(report.reason,
            "it does not go on: elbow is 0.80 rad off (now 0.20, then 1.00): --to-start "
            "(~to_start) takes it there first");
}

TEST_F(PlayerArm, stopsWhenTheArmWasMovedBetweenTwoGoals) {
  record(kArm, 6000, elbowGoal("b", {{0, 2}, {2, 1}}));
  actFor({4000});
  at(5000, [this] { elbow = 1.2; });
  const PlayReport report = playArm(9000);
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(sink.on(kArm.topic).size(), 1u);
  EXPECT_NE(report.reason.find("elbow is 0.80 rad off"), std::string::npos) << report.reason;
}

TEST_F(PlayerArm, hasTheTimelineWaitForAnArmThatMayGoThereFirst) {
  record(kArm, 6000, elbowGoal("b", {{0, 2}, {2, 1}}));
  record(kSay, 6500, test::text("now"));
  arm_options.elsewhere = ArmStartOptions::Elsewhere::Approach;
  actFor({4000, 5000});
  at(5000, [this] { elbow = 1.4; });  // 1.5 * 0.6 rad / 0.3 rad/s = 3 s away
  EXPECT_TRUE(playArm(9000).is_complete);
  EXPECT_EQ(sink.times(kArm.topic), (Times{0, 6000}));
  const std::vector<double> times = timesFromStart(sink.on(kArm.topic)[1].bytes);
  ASSERT_EQ(times.size(), 3u);
  EXPECT_NEAR(times[1], 3, 1e-6);
  EXPECT_NEAR(times[2], 5, 1e-6);
  EXPECT_EQ(sink.times("/robotsound"), Times{9500}) << "3 s later, too";
}

TEST_F(PlayerArm, goesOnFromWhereALateArmWasHalted) {
  at(2000, [this] {
    elbow = 0.4;  // 1 rad when it was recorded
    player->pause();
  });
  at(12'000, [this] { player->resume(); });
  at(17'000, [this] { player->onGoalStatus("fresh-2", 3); });
  EXPECT_TRUE(playArm(5000).is_complete);
  const Bytes goal = sink.on(kArm.topic).at(1).bytes;
  EXPECT_NEAR(firstPosition(goal), 0.4, 1e-9);
  EXPECT_NEAR(timesFromStart(goal).back(), 3.2 + 0.375, 1e-6) << "along its path, no faster";
}

TEST_F(PlayerArm, hasWhatIsSaidWaitForAnArmThatSetsOffAgain) {
  record(kSay, 3000, test::text("now"));
  at(2000, [this] {
    elbow = 1;
    player->pause();
  });
  at(12'000, [this] { player->resume(); });
  at(14'500, [this] { player->onGoalStatus("fresh-2", 3); });
  EXPECT_TRUE(playArm(5000).is_complete);
  EXPECT_EQ(sink.times("/robotsound"), Times{13'375});
}

TEST_F(PlayerArm, stopsAfterASeekToWhereTheArmIsNot) {
  at(2000, [this] {
    elbow = 1;
    player->seek({200 * kMs});
  });
  const PlayReport report = playArm(5000);
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(sink.on(kArm.topic).size(), 1u);
}

TEST_F(PlayerArm, givesASeekItsLeadWhereTheArmMayGoThereFirst) {
  arm_options.elsewhere = ArmStartOptions::Elsewhere::Approach;
  options.seek_lead_s = 6;
  at(2000, [this] {
    elbow = 1;
    player->seek({1'000'000'000});
  });
  at(12'000, [this] { player->onGoalStatus("fresh-2", 3); });
  EXPECT_TRUE(playArm(5000).is_complete);
  const std::vector<double> times = timesFromStart(sink.on(kArm.topic).at(1).bytes);
  ASSERT_GT(times.size(), 3u);
  EXPECT_NEAR(times[1], 6 - 0.375, 1e-6) << "there at rest, and sets off";
  EXPECT_NEAR(times.back(), 9, 1e-6);
}

const Channel kHead = channelOf(
      "/head/point_head/goal", "control_msgs/PointHeadActionGoal",
      withTypes("Header header\nactionlib_msgs/GoalID goal_id\nPointHeadGoal goal\n",
                "std_msgs/Header", kHeader, "actionlib_msgs/GoalID", kGoalId,
                "control_msgs/PointHeadGoal",
                "geometry_msgs/PointStamped target\ngeometry_msgs/Vector3 pointing_axis\n"
                "string pointing_frame\nduration min_duration\nfloat64 max_velocity\n",
                "geometry_msgs/PointStamped", "Header header\ngeometry_msgs/Point point\n",
                "geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n", "geometry_msgs/Vector3",
                "float64 x\nfloat64 y\nfloat64 z\n"));

/// Takes two seconds.
Bytes headGoal() {
  Value goal = blank(kHead);
  valueAt(goal, "goal.min_duration") = RosDuration{2, 0};
  return encode(schemaOf(kHead), goal);
}

TEST_F(PlayerArm, sendsAHeadGoalAgainThatWasTakenForReachedAtOnce) {
  record(kHead, 100, headGoal());
  options.gaze_frame = "head_tilt_link";
  actFor({4000});
  at(102, [this] { player->onGoalStatus("fresh-2", 3); });
  at(2200, [this] { player->onGoalStatus("fresh-3", 3); });
  EXPECT_TRUE(playArm(5000).is_complete);
  EXPECT_EQ(sink.times(kHead.topic), (Times{100, 102}));
}

double velocityOfHead(const Bytes& goal) {
  Value document = decode(schemaOf(kHead), goal);
  return std::get<double>(valueAt(document, "goal.max_velocity"));
}

/// After a pause and after a seek it has another way to go than it had.
TEST_F(PlayerArm, goesOnWithAHeadAtMostAsFastAsItWasRecorded) {
  for (int ms = 0; ms <= 6000; ms += 20) {  // 0.75 rad/s
    track.add("head_pan_joint", {kBegin + ms * kMs}, std::min(1.5, ms / 1000.0 * 0.75));
  }
  record(kHead, 100, headGoal());
  at(1000, [this] {
    elbow = 0.5;
    player->pause();
  });
  at(2000, [this] { player->resume(); });
  at(2500, [this] { player->stop("enough"); });
  playArm(5000);
  const auto goals = sink.on(kHead.topic);
  ASSERT_EQ(goals.size(), 2u);
  EXPECT_EQ(velocityOfHead(goals[0].bytes), 0) << "as it was recorded";
  EXPECT_NEAR(velocityOfHead(goals[1].bytes), 0.75 / 1.875, 0.01) << "the peak of its spline";
}

TEST_F(PlayerArm, goesOnSlowlyWithAHeadThatHardlyMovedWhenItWasRecorded) {
  record(kHead, 100, headGoal());
  at(1000, [this] {
    elbow = 0.5;
    player->pause();
  });
  at(2000, [this] { player->resume(); });
  at(2500, [this] { player->stop("enough"); });
  playArm(5000);
  EXPECT_NEAR(velocityOfHead(sink.on(kHead.topic).at(1).bytes), 0.3 / 1.875, 0.01);
}

TEST_F(PlayerArm, holdsTheGazeOfAHeadThatIsHalted) {
  record(kHead, 100, headGoal());
  options.gaze_frame = "head_tilt_link";
  at(2000, [this] {
    elbow = 1;
    player->pause();
  });
  at(3000, [this] { player->stop("enough"); });
  playArm(5000);
  const auto goals = sink.on(kHead.topic);
  ASSERT_EQ(goals.size(), 2u);
  EXPECT_EQ(goals[1].at_ms, 2000);
  Value gaze = decode(schemaOf(kHead), goals[1].bytes);
  EXPECT_EQ(std::get<std::string>(valueAt(gaze, "goal.target.header.frame_id")), "head_tilt_link");
  EXPECT_EQ(std::get<double>(valueAt(gaze, "goal.target.point.x")), 1000.0);
}

}  // namespace
}  // namespace afterglow::replay::player_arm_test
