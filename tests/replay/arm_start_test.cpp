#include "replay/motion/arm/arm_start.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "replay/messages/document.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::replay::arm_start_test {
namespace {

using Numbers = std::vector<double>;
using Elsewhere = ArmStartOptions::Elsewhere;

constexpr std::int64_t kMs = 1'000'000;
const Channel kArm = test::trajectoryGoalChannel("/arm/follow_joint_trajectory/goal");

struct Point {
  double time;
  Numbers positions, velocities = {};
};

Bytes goalOf(const std::vector<std::string>& joints, const std::vector<Point>& points) {
  Numbers times;
  for (const Point& point : points) times.push_back(point.time);
  const Schema schema = test::schemaOf(kArm);
  Value goal = decode(schema, test::goalMessage("recorded", times));
  test::at(goal, "goal.trajectory.joint_names") = Array(joints.begin(), joints.end());
  Array& array = std::get<Array>(test::at(goal, "goal.trajectory.points"));
  for (std::size_t i = 0; i < points.size(); ++i) {
    valueAt(array[i], "positions") = numberArray(points[i].positions);
    valueAt(array[i], "velocities") = numberArray(points[i].velocities);
  }
  return encode(schema, goal);
}

std::vector<Point> pointsOf(const Bytes& goal) {
  Value document = decode(test::schemaOf(kArm), goal);
  std::vector<Point> points;
  for (const Value& point : *trajectoryIn(document)->points) {
    points.push_back({static_cast<double>(timeFromStartNs(point)) * 1e-9,
                      numbersAt(point, "positions"), numbersAt(point, "velocities")});
  }
  return points;
}

/// An arm of two joints that was recorded going from 0 to 1 rad in the first second.
struct ArmStartOf : testing::Test {
  ArmStartOf() {
    for (int ms = -1000; ms <= 2000; ms += 20) {
      const double position = std::clamp(ms / 1000.0, 0.0, 1.0);
      track.add("elbow", {ms * kMs}, position);
      track.add("wrist", {ms * kMs}, -position);
    }
  }
  ArmStart start() {
    return ArmStart(
        track,
        [this](const std::string& joint) {
          const auto known = live.find(joint);
          return known == live.end() ? std::nullopt : std::optional(known->second);
        },
        options);
  }
  std::string whyNot(const Bytes& goal, std::int64_t at_ms) {
    try {
      start().leadOf(kArm, goal, {at_ms * kMs});
    } catch (const ArmElsewhere& error) {
      return error.what();
    }
    return "";
  }

  JointTrack track;
  std::map<std::string, LiveJoint> live{{"elbow", {0, 0}}, {"wrist", {0, 0}}};
  ArmStartOptions options;
  Bytes both = goalOf({"elbow", "wrist"}, {{0, {0, 0}, {0, 0}}, {1, {1, -1}, {0, 0}}});
};

TEST_F(ArmStartOf, putsTheLiveStateInThePlaceOfAFirstPointThatIsDueAtOnce) {
  live = {{"elbow", {0.03, 0.1}}, {"wrist", {-0.01, 0}}};
  const auto points = pointsOf(start().begin(kArm, both, {0}, 0));
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].time, 0);
  EXPECT_EQ(points[0].positions, (Numbers{0.03, -0.01}));
  EXPECT_EQ(points[0].velocities, (Numbers{0.1, 0}));
  EXPECT_EQ(points[1].positions, (Numbers{1, -1}));
}

TEST_F(ArmStartOf, putsTheLiveStateBeforeALaterFirstPoint) {
  const Bytes goal = goalOf({"elbow", "wrist"}, {{0.5, {0.5, -0.5}}, {1, {1, -1}}});
  const auto points = pointsOf(start().begin(kArm, goal, {0}, 0));
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0].positions, (Numbers{0, 0}));
  EXPECT_TRUE(points[0].velocities.empty()) << "as the other points have it";
  EXPECT_EQ(points[1].time, 0.5);
}

TEST_F(ArmStartOf, leavesTheBeginToControllersThatJoin) {
  options.controllers_join = true;
  live = {{"elbow", {0.45, 1}}, {"wrist", {-0.45, -1}}};  // in motion, and heard late
  const Bytes goal =
      goalOf({"elbow", "wrist"}, {{0, {0.5, -0.5}}, {0.1, {0.6, -0.6}}, {1, {1, -1}}});
  const auto points = pointsOf(start().begin(kArm, goal, {500 * kMs}, 0));
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].time, 0.1);
  EXPECT_EQ(points[0].positions, (Numbers{0.6, -0.6})) << "as it was recorded";

  live = {{"elbow", {0.54, 0}}, {"wrist", {-0.5, 0}}};  // at rest, and truly off
  const auto corrected = pointsOf(start().begin(kArm, goal, {500 * kMs}, 0));
  EXPECT_NEAR(corrected[0].positions[0], 0.6 + 0.04 / 2, 1e-9);
}

TEST_F(ArmStartOf, makesGoodWhatIsOffAlongTheWayAtTheApproachsSpeed) {
  live["elbow"].position = 0.04;  // takes 1.5 * 0.04 / 0.3 = 0.2 s
  const Bytes goal =
      goalOf({"elbow", "wrist"},
             {{0, {0, 0}}, {0.1, {0.1, -0.1}}, {0.2, {0.2, -0.2}}, {1, {1, -1}}});
  const auto points = pointsOf(start().begin(kArm, goal, {0}, 0));
  ASSERT_EQ(points.size(), 4u);
  EXPECT_NEAR(points[1].positions[0], 0.1 + 0.04 / 2, 1e-9);
  EXPECT_NEAR(points[1].positions[1], -0.1, 1e-9);
  EXPECT_NEAR(points[2].positions[0], 0.2, 1e-9);
}

TEST_F(ArmStartOf, makesGoodWhatIsOffAtTheVelocitiesThatThisTakes) {
  live["elbow"].position = 0.04;
  const Bytes goal =
      goalOf({"elbow", "wrist"},
             {{0, {0, 0}, {1, -1}}, {0.15, {0.15, -0.15}, {1, -1}}, {1, {1, -1}, {1, -1}}});
  const auto points = pointsOf(start().begin(kArm, goal, {0}, 0));
  ASSERT_EQ(points.size(), 3u) << "it is there, and begins in motion";
  // A smooth step from 1 to 0, of which three quarters of 0.2 s are over.
  EXPECT_NEAR(points[1].positions[0], 0.15 + 0.04 * (1 - 0.5625 * 1.5), 1e-9);
  EXPECT_NEAR(points[1].velocities[0], 1 - 0.04 * 6 * 0.75 * 0.25 / 0.2, 1e-9);
  EXPECT_NEAR(points[1].velocities[1], -1, 1e-9);
}

TEST_F(ArmStartOf, refusesAJointThatIsElsewhereAndSaysWhatHelps) {
  live["elbow"].position = 0.8;
  EXPECT_EQ(whyNot(both, 0),
            "elbow is 0.80 rad off (now 0.80, then 0.00): --to-start (~to_start) takes it there "
            "first");
  live["elbow"].position = 0.05;
  EXPECT_EQ(whyNot(both, -500), "");
  live["elbow"].position = 0.051;
  EXPECT_NE(whyNot(both, -500), "");
}

TEST_F(ArmStartOf, takesAJointInMotionToBeWhereItWasAroundTheMoment) {
  live = {{"elbow", {0.3, 1}}, {"wrist", {-0.5, -1}}};
  const Bytes goal = goalOf({"elbow", "wrist"}, {{0.5, {1, -1}}});
  EXPECT_EQ(whyNot(goal, 500), "") << "a quarter of a second late";
  live["elbow"].position = 0.1;
  EXPECT_NE(whyNot(goal, 500), "");
}

TEST_F(ArmStartOf, givesAJointThatIsElsewhereTheTimeToGetThereIfItMay) {
  options.elsewhere = Elsewhere::Approach;
  live["elbow"].position = 0.6;
  const ArmStart approach = start();
  const double lead = approach.leadOf(kArm, both, {0}).value();
  EXPECT_NEAR(lead, 1.5 * 0.6 / 0.3, 1e-9) << "0.3 rad/s at its fastest";
  const auto points = pointsOf(approach.begin(kArm, both, {0}, lead));
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0].positions, (Numbers{0.6, 0}));
  EXPECT_EQ(points[1].positions, (Numbers{0, 0}));
  EXPECT_NEAR(points[1].time, lead, 1e-6);
  EXPECT_NEAR(points[2].time, lead + 1, 1e-6);
}

TEST_F(ArmStartOf, standsAndSetsOffAgainWhereTheGoalBeginsInMotion) {
  options.elsewhere = Elsewhere::Approach;
  live["elbow"].position = 0.6;
  const ArmStart approach = start();
  const Bytes moving = goalOf({"elbow", "wrist"},
                              {{0, {0, 0}, {1, -1}}, {1, {1, -1}, {1, -1}}, {2, {1, -1}, {0, 0}}});
  const double lead = approach.leadOf(kArm, moving, {0}).value();
  const auto points = pointsOf(approach.begin(kArm, moving, {0}, lead));
  ASSERT_GT(points.size(), 4u) << "where it is, where it sets off, how it gets as fast";
  EXPECT_EQ(points[0].positions, (Numbers{0.6, 0}));
  EXPECT_NEAR(points[1].positions[0], 0, 1e-9);
  EXPECT_NEAR(points[1].velocities[0], 0, 1e-9);
  EXPECT_GE(points[1].time, lead - 1e-6);
}

TEST_F(ArmStartOf, goesOnFromWhereItWasHaltedThoughThatIsLate) {
  ArmStart arm = start();
  arm.begin(kArm, both, {0}, 0);
  live = {{"elbow", {0.5, 0}}, {"wrist", {-0.5, 0}}};
  arm.halted();
  const Bytes rest = goalOf({"elbow", "wrist"}, {{0.2, {1, -1}, {0, 0}}});
  const double lead = arm.leadOf(kArm, rest, {1500 * kMs}).value();
  EXPECT_NEAR(lead, 1.5 * 0.5 / 0.3, 1e-9);
  const auto points = pointsOf(arm.begin(kArm, rest, {1500 * kMs}, lead));
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[1].positions, (Numbers{1, -1})) << "where it was recorded at that moment";
  live["elbow"].position = 0.7;  // somebody has moved it since
  EXPECT_THROW(arm.leadOf(kArm, rest, {1500 * kMs}), ArmElsewhere);
}

// ------------------------------------------------------------------------------ the rest of a goal

constexpr GoalProgress goneOn(double elapsed_s) {
  return {{0}, {static_cast<std::int64_t>(elapsed_s * 1e9)}, elapsed_s};
}

TEST_F(ArmStartOf, setsOffFromRestWhereItIsOnThePath) {
  live = {{"elbow", {0.5, 0}}, {"wrist", {-0.5, 0}}};
  const ArmStart arm = start();
  const RestNeed need = arm.needToGoOn(kArm, both, goneOn(0.5)).value();
  EXPECT_NEAR(need.seconds, 1, 1e-6) << "1.5 rad/s are reached in 2 s at most";
  EXPECT_FALSE(need.is_elsewhere);
  const auto points = pointsOf(arm.goOn(kArm, both, goneOn(0.5), need.seconds));
  EXPECT_NEAR(points.front().positions[0], 0.5, 1e-9);
  EXPECT_NEAR(points.front().velocities[0], 0, 1e-9) << "from rest";
  for (std::size_t i = 1; i < points.size(); ++i) {
    EXPECT_GT(points[i].positions[0], points[i - 1].positions[0]);
    EXPECT_LT(points[i].velocities[0], 1.5);
  }
  EXPECT_NEAR(points.back().positions[0], 1, 1e-9);
}

/// The elbow's path is 1 rad in 4 s: 0.375 rad/s at its fastest.
struct SlowPath : ArmStartOf {
  Bytes slow = goalOf({"elbow"}, {{0, {0}, {0}}, {4, {1}, {0}}});
  static double pathAt(double s) { return s * s / 16 * (3 - s / 2); }
  static double velocityAt(double s) { return 6 * s / 16 * (1 - s / 4); }

  SlowPath() {
    track = JointTrack();
    for (int ms = -1000; ms <= 5000; ms += 20) {
      track.add("elbow", {ms * kMs}, pathAt(std::clamp(ms / 1000.0, 0.0, 4.0)));
    }
  }
  double need(double elapsed_s, const LiveJoint& elbow) {
    live = {{"elbow", elbow}};
    return start().needToGoOn(kArm, slow, goneOn(elapsed_s)).value().seconds;
  }
};

TEST_F(SlowPath, isSetOffOnByItsSpeedAndTheJointsLimit) {
  EXPECT_NEAR(need(2, {0.5, 0}), 0.375 * 1.5 / 2, 1e-3) << "half of the ramp is lost";
  options.limits.joints["elbow"].acceleration = 0.5;
  EXPECT_NEAR(need(2, {0.5, 0}), 0.375 * 1.5 / 0.5 / 2, 1e-3);
  EXPECT_NEAR(need(2, {0.5, 0.375 / 2}), 0.375 / 2 * 1.5 / 0.5 / 4, 1e-3)
      << "half as fast as the path, it loses a quarter of half the ramp";
}

TEST_F(SlowPath, isGotOntoFromBesideItWithoutHurry) {
  options.tolerances.turning = 0.05;
  slow = goalOf({"elbow", "wrist"}, {{0, {0, 0}, {0, 0}}, {4, {1, 0}, {0, 0}}});
  for (int ms = -1000; ms <= 5000; ms += 20) track.add("wrist", {ms * kMs}, 0);
  live = {{"elbow", {0.5, 0}}, {"wrist", {0.04, 0}}};
  // 0.04 rad with a peak of 0.1 rad/s, which is 60 % of the ramp.
  EXPECT_NEAR(start().needToGoOn(kArm, slow, goneOn(2)).value().seconds,
              1.875 * 0.04 / 0.1 / 0.6 / 2, 1e-2);
}

TEST_F(SlowPath, catchesUpWithJointsThatAreAheadAndEndsWhenItDid) {
  const double ahead = 2.3;
  for (const double pace : {0.0, 0.5}) {
    const LiveJoint elbow{pathAt(ahead), pace * velocityAt(ahead)};
    EXPECT_NEAR(need(2, elbow), 0, 0.01);
    EXPECT_NEAR(pointsOf(start().goOn(kArm, slow, goneOn(2), 0)).back().time, 2, 0.01) << pace;
  }
}

TEST_F(ArmStartOf, setsOffAsFastAsThePathIsSoon) {
  const Bytes goal = goalOf({"elbow", "wrist"}, {{0, {0, 0}}, {1, {0, 0}}, {2, {0.5, 0}}});
  EXPECT_NEAR(start().needToGoOn(kArm, goal, {{-1000 * kMs}, {-500 * kMs}, 0.5}).value().seconds,
              0.5 * 1.5 / 2, 1e-6);
}

TEST_F(ArmStartOf, goesOnWithTheEffortsThatWereMeantForEachPart) {
  const Schema schema = test::schemaOf(kArm);
  Value goal = decode(schema, goalOf({"elbow"}, {{0, {0}}, {1, {1}}, {2, {1}}, {3, {1}}}));
  Array& recorded = std::get<Array>(test::at(goal, "goal.trajectory.points"));
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    valueAt(recorded[i], "effort") = numberArray({static_cast<double>(i)});
  }
  live = {{"elbow", {1, 0}}};
  Value rest = decode(schema, start().goOn(kArm, encode(schema, goal), goneOn(1.2), 0));
  const Array& points = *trajectoryIn(rest)->points;
  for (const Value& point : points) {
    const double path_s = 1.2 + secondsOf(point) - 0.1;  // it sets off within 0.2 s
    EXPECT_EQ(numbersAt(point, "effort"), Numbers{path_s < 2.01 ? 2.0 : 3.0}) << path_s;
  }
  EXPECT_NEAR(secondsOf(points.back()), 1.9, 1e-3);
}

TEST_F(ArmStartOf, movesAHeadAsFastAsItWasWithinTheGoalAndItsLimit) {
  for (int ms = -2000; ms <= 4000; ms += 20) {
    track.add("head_pan", {ms * kMs}, ms < 0 ? 2e-3 * ms : ms > 1000 ? 0.9e-3 * (ms - 1000) : 0);
  }
  EXPECT_NEAR(start().headVelocity({0}, {0}), 0.9 / 1.875, 1e-3) << "within 3 s";
  EXPECT_NEAR(start().headVelocity({-4000 * kMs}, {500 * kMs}), 2 / 1.875, 1e-3);
  options.limits.joints["head_pan"].velocity = 0.5;
  EXPECT_NEAR(start().headVelocity({0}, {0}), 0.5 / 1.875, 1e-9);
  EXPECT_NEAR(start().headVelocity({8000 * kMs}, {8000 * kMs}), 0.3 / 1.875, 1e-9)
      << "as an approach, where nothing is known";
}

TEST_F(ArmStartOf, goesOnWithoutAFirstPointWhereTheControllersJoin) {
  live = {{"elbow", {0.5, 0}}, {"wrist", {-0.5, 0}}};
  const auto given = pointsOf(start().goOn(kArm, both, goneOn(0.5), 1));
  options.controllers_join = true;
  const auto points = pointsOf(start().goOn(kArm, both, goneOn(0.5), 1));
  ASSERT_EQ(points.size(), given.size() - 1);
  EXPECT_GT(points.front().time, 0.01);
  EXPECT_EQ(points.front().positions, given[1].positions);
}

TEST_F(ArmStartOf, goesOnOnThePathWhereALateArmWasHalted) {
  ArmStart arm = start();
  arm.begin(kArm, both, {0}, 0);
  live = {{"elbow", {0.5, 0}}, {"wrist", {-0.5, 0}}};
  arm.halted();
  const RestNeed need = arm.needToGoOn(kArm, both, goneOn(1.5)).value();
  EXPECT_NEAR(need.seconds, 0.5 + 1, 0.01) << "half of the goal is left, which lies behind";
  EXPECT_FALSE(need.is_elsewhere);
}

TEST_F(ArmStartOf, isHeldWhereItIsWhileOthersNeedLonger) {
  live = {{"elbow", {0.5, 0}}, {"wrist", {-0.5, 0}}};
  const auto points = pointsOf(start().goOn(kArm, both, goneOn(0.5), 3));
  EXPECT_NEAR(points[1].time, 3 - 1, 1e-6);
  EXPECT_EQ(points[1].positions, points[0].positions);
}

TEST_F(ArmStartOf, standsWhereThePathGoesOnBeforeItSetsOffFromElsewhere) {
  options.elsewhere = Elsewhere::Approach;
  live = {{"elbow", {0.9, 0}}, {"wrist", {-0.9, 0}}};
  const ArmStart arm = start();
  const RestNeed need = arm.needToGoOn(kArm, both, goneOn(0.25)).value();
  EXPECT_TRUE(need.is_elsewhere);
  const auto points = pointsOf(arm.goOn(kArm, both, goneOn(0.25), need.seconds));
  EXPECT_NEAR(points[1].positions[0], 0.15625, 1e-9);
  EXPECT_NEAR(points[1].time, 1.5 * (0.9 - 0.15625) / 0.3, 1e-6);
  EXPECT_NEAR(points[1].velocities[0], 0, 1e-9);
  for (std::size_t i = 2; i < points.size(); ++i) {
    EXPECT_GT(points[i].positions[0], points[i - 1].positions[0]) << "never back";
  }
}

TEST_F(ArmStartOf, goesOnFromMotionWithoutAHalt) {
  live = {{"elbow", {0.5, 1.5}}, {"wrist", {-0.5, -1.5}}};
  const ArmStart arm = start();
  EXPECT_NEAR(arm.needToGoOn(kArm, both, goneOn(0.5)).value().seconds, 0, 1e-6);
  EXPECT_NEAR(pointsOf(arm.goOn(kArm, both, goneOn(0.5), 0)).front().velocities[0], 1.5, 0.01);
}

TEST_F(ArmStartOf, beginsTheRestAsAGoalOfItsOwnWhereItsPathIsNotKnown) {
  track = JointTrack();
  live["elbow"].position = 0.2;
  const Bytes goal = goalOf({"elbow"}, {{1, {0.5}}, {2, {1.0}}});
  const auto points = pointsOf(start().goOn(kArm, goal, goneOn(0.4), 0));
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0].positions, Numbers{0.2});
  EXPECT_NEAR(points[1].time, 0.6, 1e-6);
}

TEST_F(ArmStartOf, needsTheTimeToGetToTheRestOfAGoalWhosePathIsNotKnown) {
  track = JointTrack();
  options.elsewhere = Elsewhere::Approach;
  const Bytes goal = goalOf({"elbow"}, {{1, {0.5}}, {2, {1.0}}});
  live["elbow"].position = 0.2;
  RestNeed need = start().needToGoOn(kArm, goal, goneOn(0.4)).value();
  EXPECT_EQ(need.seconds, 0) << "0.3 rad in 0.6 s are no faster than the goal";
  EXPECT_FALSE(need.is_elsewhere);
  live["elbow"].position = -0.2;
  need = start().needToGoOn(kArm, goal, goneOn(0.4)).value();
  EXPECT_NEAR(need.seconds, 1.5 * 0.7 / 0.3, 1e-9);
  EXPECT_TRUE(need.is_elsewhere);
}

TEST_F(ArmStartOf, goesOnAsItWasRecordedWhereNobodyTellsOfAJointAndAnyStartWillDo) {
  live.erase("wrist");
  options.elsewhere = Elsewhere::Accept;
  const auto points = pointsOf(start().goOn(kArm, both, goneOn(0.5), 0));
  ASSERT_EQ(points.size(), 1u);
  EXPECT_NEAR(points[0].time, 0.5, 1e-9);
  EXPECT_EQ(points[0].positions, (Numbers{1, -1}));
}

TEST_F(ArmStartOf, settlesOnASinglePointThatWasDueAtOnce) {
  live = {{"elbow", {1, 0}}, {"wrist", {-1, 0}}};
  const Bytes goal = goalOf({"elbow", "wrist"}, {{0, {1, -1}}});
  const GoalProgress begun{{1500 * kMs}, {1500 * kMs}, 0};
  const auto points = pointsOf(start().goOn(kArm, goal, begun, 0));
  EXPECT_EQ(points.back().positions, (Numbers{1, -1}));
  EXPECT_GT(points.back().time, 0);
}

TEST_F(ArmStartOf, refusesToGoOnElsewhere) {
  live["elbow"].position = 0.9;
  EXPECT_THROW(start().needToGoOn(kArm, both, goneOn(0.25)), ArmElsewhere);
}

// ------------------------------------------------------------------------------ what is not known

TEST_F(ArmStartOf, refusesJointsThatNobodyTellsOfUnlessAnyStartWillDo) {
  live.erase("wrist");
  EXPECT_EQ(whyNot(both, 0), "nobody tells where wrist is (/joint_states)");
  options.elsewhere = Elsewhere::Accept;
  EXPECT_EQ(start().leadOf(kArm, both, {0}), 0.0);
  EXPECT_EQ(pointsOf(start().begin(kArm, both, {0}, 0)).size(), 2u) << "as it was recorded";
}

TEST_F(ArmStartOf, comparesWithAFirstPointThatIsDueAtOnceWhereNoJointStatesWereRecorded) {
  track = JointTrack();
  EXPECT_EQ(whyNot(both, 0), "");
  live["wrist"].position = 0.3;
  EXPECT_NE(whyNot(both, 0), "");
}

TEST_F(ArmStartOf, letsAnUnrecordedJointGoToALaterPointNoFasterThanTheGoalItself) {
  track = JointTrack();
  const Bytes goal = goalOf({"elbow"}, {{1, {0.5}}, {2, {1.0}}});
  live["elbow"].position = 0.1;
  EXPECT_EQ(whyNot(goal, 0), "");
  live["elbow"].position = -0.1;
  EXPECT_NE(whyNot(goal, 0), "") << "0.6 rad in a second, and the goal has 0.5 rad/s";
  options.elsewhere = Elsewhere::Approach;
  EXPECT_NEAR(start().leadOf(kArm, goal, {0}).value(), 1.5 * 0.6 / 0.3, 1e-9);
  options.elsewhere = Elsewhere::Refuse;
  const Bytes later = goalOf({"elbow"}, {{2, {0.1}}, {2.5, {0.5}}});
  live["elbow"].position = -1.4;
  EXPECT_EQ(whyNot(later, 0), "") << "0.75 rad/s, where the goal has 0.8";
  live["elbow"].position = -1.6;
  EXPECT_NE(whyNot(later, 0), "") << "0.85 rad/s";
}

TEST_F(ArmStartOf, holdsASinglePointOfAnUnrecordedJointToItsLimit) {
  track = JointTrack();
  options.limits.joints["elbow"].velocity = 1.0;
  const Bytes goal = goalOf({"elbow"}, {{1, {0.9}}});
  EXPECT_EQ(whyNot(goal, 0), "");
  live["elbow"].position = -0.2;
  EXPECT_NE(whyNot(goal, 0), "");
}

TEST_F(ArmStartOf, givesASinglePointThatIsDueAtOnceTheTimeThatItsWayTakes) {
  const auto points =
      pointsOf(start().begin(kArm, goalOf({"elbow", "wrist"}, {{0, {0.06, 0}}}), {0}, 0));
  ASSERT_EQ(points.size(), 2u);
  EXPECT_NEAR(points[1].time, 0.3, 1e-9);
}

TEST_F(ArmStartOf, takesAWholeTurnForNoWayOnlyOfAJointThatTurnsWithoutEnd) {
  live["elbow"].position = 2 * kPi;
  EXPECT_NE(whyNot(both, 0), "");
  options.robot = RobotJoints("", {{"elbow", {RobotJoint::Kind::Endless, {}, {}}}}, {});
  EXPECT_EQ(whyNot(both, 0), "");
  EXPECT_NEAR(pointsOf(start().begin(kArm, both, {0}, 0))[0].positions[0], 0, 1e-9)
      << "as many turns on as the goal";
}

TEST_F(ArmStartOf, refusesASinglePointThatIsTooFarFromWhereTheArmIs) {
  const Bytes goal = goalOf({"elbow", "wrist"}, {{0.5, {1, -1}}});
  options.limits.joints["elbow"].velocity = options.limits.joints["wrist"].velocity = 1.2;
  options.elsewhere = Elsewhere::Accept;
  live = {{"elbow", {0.5, 0}}, {"wrist", {-0.5, 0}}};
  EXPECT_NO_THROW(start().begin(kArm, goal, {500 * kMs}, 0)) << "1 rad/s";
  live["elbow"].position = 0;
  try {
    start().begin(kArm, goal, {500 * kMs}, 0);
    FAIL() << "2 rad/s";
  } catch (const ArmElsewhere& error) {
    EXPECT_STREQ(error.what(),
                 "elbow would go from 0 to 1 in 0.5 s, at 2/s: 1.2/s is the limit");
  }
  EXPECT_NO_THROW(start().begin(kArm, goal, {500 * kMs}, 2)) << "with time to get there";
  options.limits = {};
  live["elbow"].position = 0.46;
  EXPECT_NO_THROW(start().begin(kArm, goal, {500 * kMs}, 0)) << "as it did, give or take";
  live["elbow"].position = 0;
  EXPECT_THROW(start().begin(kArm, goal, {500 * kMs}, 0), ArmElsewhere);
}

TEST_F(ArmStartOf, refusesPointsThatAreNoNumbersOrLackJoints) {
  EXPECT_THROW(start().leadOf(kArm, goalOf({"elbow"}, {{1, {std::nan("")}}}), {0}), MessageError);
  EXPECT_THROW(start().leadOf(kArm, goalOf({"elbow", "wrist"}, {{1, {0.1}}}), {0}), MessageError);
}

TEST_F(ArmStartOf, leavesGoalsWithoutATrajectoryAlone) {
  const Bytes goal = goalOf({"elbow"}, {});
  EXPECT_FALSE(start().leadOf(kArm, goal, {0}));
  EXPECT_EQ(start().begin(kArm, goal, {0}, 1), goal);
  EXPECT_FALSE(start().needToGoOn(kArm, goal, goneOn(0.5)));
  EXPECT_EQ(start().goOn(kArm, goal, goneOn(0.5), 1), goal);
}

TEST_F(ArmStartOf, knowsAJointByTheSamplesAroundAMoment) {
  const auto reach = track.around("elbow", {505 * kMs}, 100 * kMs);
  ASSERT_TRUE(reach);
  EXPECT_NEAR(reach->at, 0.505, 1e-9);
  EXPECT_NEAR(reach->least, 0.42, 1e-9);
  EXPECT_NEAR(reach->most, 0.6, 1e-9);
  EXPECT_NEAR(track.around("elbow", {500 * kMs}, 100 * kMs)->least, 0.4, 1e-9) << "to both ends";
  EXPECT_NEAR(track.around("elbow", {500 * kMs}, 100 * kMs)->most, 0.6, 1e-9);
  EXPECT_FALSE(track.around("elbow", {3500 * kMs}, 100 * kMs)) << "not heard of for 1.5 s";
  EXPECT_FALSE(track.around("knee", {0}, 100 * kMs));
}

TEST_F(ArmStartOf, leavesOutPositionsThatAreNoNumbers) {
  JointTrack heard;
  heard.add("elbow", {0}, std::nan(""));
  EXPECT_TRUE(heard.names().empty());
  heard.add("elbow", {0}, 0.5);
  heard.add("elbow", {100 * kMs}, std::numeric_limits<double>::infinity());
  EXPECT_EQ(heard.at({200 * kMs}).at("elbow"), 0.5);
  EXPECT_EQ(heard.fastest("knee", {0}, {1000 * kMs}), 0) << "nobody told of it";
  EXPECT_EQ(heard.fastest("elbow", {5000 * kMs}, {6000 * kMs}), 0) << "not heard of by then";
}

TEST_F(ArmStartOf, thinsSamplesThatComeFasterThanEveryTenMilliseconds) {
  JointTrack fast;
  for (int ms = 0; ms <= 100; ++ms) fast.add("elbow", {ms * kMs}, ms * 0.01);
  EXPECT_NEAR(fast.around("elbow", {100 * kMs}, 0)->at, 1.0, 1e-9) << "the newest is kept";
  EXPECT_NEAR(fast.around("elbow", {50 * kMs}, 0)->at, 0.5, 1e-9);
  JointTrack shaken;
  for (int ms = 0; ms <= 100; ms += 5) shaken.add("elbow", {ms * kMs}, ms % 10);
  EXPECT_EQ(shaken.around("elbow", {50 * kMs}, 10 * kMs)->most, 5) << "each second one is enough";
}

}  // namespace
}  // namespace afterglow::replay::arm_start_test
