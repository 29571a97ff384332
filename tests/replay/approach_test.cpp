// By which way joints go to where a motion begins.
#include "replay/motion/arm/approach.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "replay/motion/arm/arm_start.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::replay::approach_test {
namespace {

using Kind = JointWay::Kind;
using Numbers = std::vector<double>;

constexpr std::int64_t kMs = 1'000'000, kSecond = 1000 * kMs;
const std::vector<std::string> kJoints = {"shoulder", "elbow"};

/// An arm that was recorded, before moment 0, going round something: first the elbow from 0 to 1
/// rad, then the shoulder from 0 to 1 rad, in four seconds each; then it stood for one.
struct ApproachOf : testing::Test {
  ApproachOf() {
    for (int ms = -12'000; ms <= 0; ms += 20) {
      const double elbow = std::clamp((ms + 9000) / 4000.0, 0.0, 1.0);
      const double shoulder = std::clamp((ms + 5000) / 4000.0, 0.0, 1.0);
      track.add("elbow", {ms * kMs}, elbow + noise(ms));
      track.add("shoulder", {ms * kMs}, shoulder - noise(ms));
    }
  }
  /// Both joints, from one moment to another, ms.
  void stand(int from, int to, double position) {
    for (int ms = from; ms <= to; ms += 20) {
      for (const std::string& joint : kJoints) track.add(joint, {ms * kMs}, position);
    }
  }
  /// Of encoders.
  static double noise(int ms) { return 0.002 * std::sin(ms * 0.7); }
  Approach approach() const { return Approach(track, base, rules); }
  JointWay wayFrom(const Numbers& from) const {
    return approach().wayTo(kJoints, from, {1, 1}, {0});
  }
  std::string whyNot(const Numbers& from, const Numbers& to = {1, 1}) const {
    try {
      approach().wayTo(kJoints, from, to, {0});
    } catch (const ApproachRefused& refusal) {
      return refusal.what();
    }
    return "";
  }
  static void expectNear(const Numbers& is, const Numbers& should, double tolerance = 0.02) {
    ASSERT_EQ(is.size(), should.size());
    for (std::size_t i = 0; i < is.size(); ++i) EXPECT_NEAR(is[i], should[i], tolerance) << i;
  }

  JointTrack track;
  std::optional<PoseTrack> base;
  Approach::Rules rules;
};

TEST(JointTrack, tellsWhereAJointWasWithoutWhatAnEarlierRecordingHadSeenLast) {
  JointTrack track;
  track.add("lift", {0}, 0.7);
  track.add("lift", {4000 * kMs}, -1);
  EXPECT_EQ(track.at({500 * kMs}).at("lift"), 0.7);
  EXPECT_EQ(track.at({1900 * kMs}).at("lift"), 0.7);
  EXPECT_EQ(track.at({3990 * kMs}).at("lift"), -1);
  EXPECT_EQ(track.at({2000 * kMs}).at("lift"), 0.7) << "the last, where both are as near";
  track.add("lift", {4500 * kMs}, 0.2);
  EXPECT_EQ(track.at({4500 * kMs}).at("lift"), 0.2) << "a moment has what is told at it";
}

TEST(JointTrack, knowsAJointWithinASecondOfWhatWasHeardOfIt) {
  JointTrack track;
  track.add("lift", {10 * kSecond}, 0.5);
  track.add("lift", {20 * kSecond}, 0.6);
  for (const std::int64_t ms : {9'000, 10'500, 11'000, 19'000, 19'500, 21'000}) {
    EXPECT_TRUE(track.around("lift", {ms * kMs}, 0)) << ms;
  }
  for (const std::int64_t ms : {8'990, 11'010, 15'000, 18'990, 21'010}) {
    EXPECT_FALSE(track.around("lift", {ms * kMs}, 0)) << ms;
  }
}

TEST(JointTrack, tellsTheFastestOfAnIntervalAndOfNoneBefore) {
  JointTrack track;
  for (int ms = -1000; ms <= 2000; ms += 20) {
    track.add("lift", {ms * kMs}, ms < 0 ? 0.001 * ms : ms > 1000 ? 0.0005 * (ms - 1000) : 0);
  }
  EXPECT_NEAR(track.fastest("lift", {-1000 * kMs}, {-500 * kMs}), 1, 1e-6);
  EXPECT_EQ(track.fastest("lift", {0}, {700 * kMs}), 0) << "it stood";
  EXPECT_NEAR(track.fastest("lift", {0}, {1500 * kMs}), 0.5, 1e-6);
}

TEST_F(ApproachOf, goesAShortWayStraight) {
  const JointWay way = wayFrom({0.81, 1.19});
  EXPECT_EQ(way.kind, Kind::Short);
  ASSERT_EQ(way.rests.size(), 2u);
  EXPECT_NEAR(way.seconds(), 1.5 * 0.19 / 0.3, 1e-9) << "0.3 rad/s at its fastest";
}

TEST_F(ApproachOf, goesALongWayAsItWasRecordedRoundTheSameCorner) {
  const JointWay way = wayFrom({0.05, 0.02});
  EXPECT_EQ(way.kind, Kind::Recorded);
  ASSERT_GE(way.rests.size(), 3u);
  ASSERT_LE(way.rests.size(), 5u) << "a line needs no rests in between";
  EXPECT_EQ(way.rests.front().positions, (Numbers{0.05, 0.02})) << "from where it is";
  EXPECT_EQ(way.rests.back().positions, (Numbers{1, 1}));
  const bool goes_round = std::any_of(way.rests.begin(), way.rests.end(), [](const auto& rest) {
    return std::abs(rest.positions[0]) < 0.03 && std::abs(rest.positions[1] - 1) < 0.03;
  });
  EXPECT_TRUE(goes_round) << "the elbow first";
  for (std::size_t i = 1; i < way.rests.size(); ++i) {
    const double seconds = way.rests[i].at_s - way.rests[i - 1].at_s;
    for (std::size_t k = 0; k < 2; ++k) {
      const double rad = way.rests[i].positions[k] - way.rests[i - 1].positions[k];
      EXPECT_LE(1.5 * std::abs(rad) / seconds, 0.3 + 1e-9);
    }
  }
}

TEST_F(ApproachOf, joinsTheRecordedWayWhereItIsNearest) {
  const JointWay way = wayFrom({0.03, 0.5});
  EXPECT_EQ(way.kind, Kind::Recorded);
  expectNear(way.rests[1].positions, {0, 0.5}, 0.05);
}

/// Of a slow way every look is a little nearer or farther, as encoders err.
TEST_F(ApproachOf, isNotMisledByEncodersOnASlowWay) {
  track = JointTrack();
  for (int ms = -60'000; ms <= 0; ms += 20) {
    track.add("elbow", {ms * kMs}, 1 + ms / 60'000.0 + noise(ms));
    track.add("shoulder", {ms * kMs}, -noise(ms));
  }
  const JointWay way = approach().wayTo(kJoints, {0.03, 0.5}, {0, 1}, {0});
  EXPECT_EQ(way.kind, Kind::Recorded);
  expectNear(way.rests[1].positions, {0, 0.5}, 0.05);
}

/// Over a corner every 0.1 rad, the elbow first; the shoulder is a slow joint.
TEST_F(ApproachOf, setsOffGentlyFromEveryRest) {
  track = JointTrack();
  for (int ms = -8000; ms <= 0; ms += 20) {
    const double steps = (ms + 8000) / 1000.0, whole = std::floor(steps / 2);
    track.add("elbow", {ms * kMs}, 0.1 * (whole + std::min(1.0, steps - 2 * whole)));
    track.add("shoulder", {ms * kMs}, 0.1 * (whole + std::max(0.0, steps - 2 * whole - 1)));
  }
  rules.limits.joints["shoulder"].velocity = 0.15;
  const JointWay way = approach().wayTo(kJoints, {0, 0}, {0.4, 0.4}, {0});
  EXPECT_EQ(way.kind, Kind::Recorded);
  ASSERT_GE(way.rests.size(), 8u);
  double slowest = 0;
  for (std::size_t i = 1; i < way.rests.size(); ++i) {
    const double seconds = way.rests[i].at_s - way.rests[i - 1].at_s;
    for (std::size_t k = 0; k < 2; ++k) {
      const double rad = std::abs(way.rests[i].positions[k] - way.rests[i - 1].positions[k]);
      EXPECT_LE(6 * rad / (seconds * seconds), (k == 0 ? 0.5 : 1) + 1e-6) << "rad/s^2";
    }
    slowest = std::max(slowest, seconds);
  }
  EXPECT_LT(slowest, 1.3) << "no slower than that takes";
}

TEST_F(ApproachOf, refusesAWayThatWasNotRecordedAndNamesEveryJointAndTheWayOut) {
  EXPECT_EQ(whyNot({0.5, 0.1}),
            "it would move elbow by 0.90 rad, shoulder by 0.50 rad on a way that nobody has "
            "checked: none was recorded from near where it is. By itself a joint goes at most 0.2 "
            "rad or 0.02 m; --unchecked-approach (~unchecked_approach) has it go straight");
  rules.accepts_unchecked = true;
  const JointWay way = wayFrom({0.5, 0.1});
  EXPECT_EQ(way.kind, Kind::Unchecked);
  EXPECT_EQ(way.rests.size(), 2u);
}

TEST_F(ApproachOf, namesFirstTheJointThatIsFarthestForOneOfItsKind) {
  try {
    approach().wayTo({"elbow", "torso_lift", "wrist"}, {0, 0, 0}, {0.9, 0.1, 0.2}, {0});
    ADD_FAILURE() << "nobody has recorded that";
  } catch (const ApproachRefused& refusal) {
    const std::string why = "it would move torso_lift by 0.10 m, elbow by 0.90 rad on a way that";
    EXPECT_EQ(std::string(refusal.what()).find(why), 0u) << refusal.what();
  }
}

TEST_F(ApproachOf, goesStraightWhereSomebodyFindsEveryPoseOnTheWayFree) {
  std::vector<Numbers> asked;
  const auto wall = [&](const auto&, const Numbers& pose) {
    asked.push_back(pose);
    return std::string(pose[1] > 0.52 && pose[1] < 0.58 ? "something stands there" : "");
  };
  EXPECT_EQ(approach().wayTo(kJoints, {0.5, 0.62}, {1, 1}, {0}, wall).kind, Kind::Checked);
  ASSERT_EQ(asked.size(), 10u) << "every 0.05 rad, but where it is";
  expectNear(asked.back(), {1, 1}, 1e-9);
  EXPECT_EQ(wayFrom({0, 0}).kind, Kind::Recorded) << "nobody is asked for that";
  try {
    approach().wayTo(kJoints, {0.5, 0.1}, {1, 1}, {0}, wall);
    ADD_FAILURE() << "it went through";
  } catch (const ApproachRefused& refusal) {
    EXPECT_STREQ(refusal.what(),
                 "it would move straight, as no other way was recorded, and 50 % of the way on "
                 "something stands there");
  }
}

/// As to the start of a behavior from its recorded end, or to before where a goal is now.
TEST_F(ApproachOf, goesBackAWayThatWasRecordedFromThereOn) {
  const auto back = [&] { return approach().wayTo(kJoints, {1, 1}, {0, 0}, {-10 * kSecond}); };
  const JointWay way = back();
  EXPECT_EQ(way.kind, Kind::Recorded);
  EXPECT_EQ(way.rests.front().positions, (Numbers{1, 1}));
  EXPECT_EQ(way.rests.back().positions, (Numbers{0, 0}));
  const bool goes_round = std::any_of(way.rests.begin(), way.rests.end(), [](const auto& rest) {
    return std::abs(rest.positions[0]) < 0.03 && std::abs(rest.positions[1] - 1) < 0.03;
  });
  EXPECT_TRUE(goes_round) << "the shoulder first";
  EXPECT_NEAR(way.seconds(), 1.5 * 2 / 0.3, 1) << "at the speed of every way to the start";

  using Samples = std::vector<PoseTrack::Sample>;
  const Stamp begin{-12 * kSecond}, end{0};
  base = PoseTrack(Samples{{begin, {0, 0, 0}}, {end, {0, 0, 0}}}, "map", true);
  EXPECT_EQ(back().kind, Kind::Recorded);
  base = PoseTrack(Samples{{begin, {0, 0, 0}}, {{-7 * kSecond}, {0, 0, 0}}, {end, {1, 0, 0}}},
                   "map", true);
  EXPECT_THROW(back(), ApproachRefused) << "it drove on meanwhile";
  base = PoseTrack(Samples{{begin, {0, 0, 0}}, {{-7 * kSecond}, {0, 0, 0}}}, "map", true);
  EXPECT_THROW(back(), ApproachRefused) << "nobody knows where it went";
}

TEST_F(ApproachOf, goesTheShorterOfTwoRecordedWays) {
  for (int ms = 20; ms <= 2000; ms += 20) {  // on from there, both at once
    const double position = 1 - ms / 2000.0;
    for (const std::string& joint : kJoints) track.add(joint, {ms * kMs}, position);
  }
  const JointWay way = wayFrom({0, 0});
  EXPECT_EQ(way.kind, Kind::Recorded);
  EXPECT_NEAR(way.seconds(), 1.5 / 0.3, 1.5) << "by the last two seconds, not round the corner";
}

TEST_F(ApproachOf, doesNotTakeAJumpBetweenRecordingsForAWay) {
  track = JointTrack();
  stand(-60'000, -59'000, 0);  // another behavior, a minute ago
  stand(-1000, 0, 1);
  EXPECT_NE(whyNot({0, 0}), "");
}

TEST_F(ApproachOf, goesOnOverATimeThatNobodyRecordedWhereItStoodAsBefore) {
  track = JointTrack();
  for (int ms = 0; ms <= 4000; ms += 20) {
    for (const std::string& joint : kJoints) {
      track.add(joint, {-60 * kSecond + ms * kMs}, ms / 4000.0);
    }
  }
  stand(-4000, 0, 1);
  EXPECT_EQ(wayFrom({0.1, 0.1}).kind, Kind::Recorded);
}

TEST_F(ApproachOf, endsWhereTheBaseWasStillOnItsWay) {
  base = PoseTrack({{{-12 * kSecond}, {0, 0, 0}}, {{-3 * kSecond}, {0, 0, 0}}, {{0}, {0, 0, 0}}},
                   "map", true);
  EXPECT_EQ(whyNot({0, 0}), "");
  const auto standsOff = [&](const PlanarPose& pose) {
    base = PoseTrack(
        {{{-12 * kSecond}, pose}, {{-4 * kSecond}, pose}, {{-3 * kSecond}, {}}, {{0}, {}}}, "map",
        true);
    return whyNot({0, 0});
  };
  EXPECT_EQ(standsOff({0.05, 0, 0}), "") << "as far as it may stand from where it did";
  EXPECT_EQ(standsOff({0, 0, 3 / kDegreesPerRadian}), "");
  EXPECT_NE(standsOff({0.08, 0, 0}), "");
  EXPECT_NE(standsOff({0, 0, 5 / kDegreesPerRadian}), "");
  base = PoseTrack({{{-12 * kSecond}, {0, 0, 0}}, {{-3 * kSecond}, {1, 0, 0}}, {{0}, {1, 0, 0}}},
                   "map", true);
  EXPECT_NE(whyNot({0, 0}), "") << "the elbow was moved elsewhere";
  EXPECT_EQ(wayFrom({0.6, 1}).kind, Kind::Recorded) << "the last seconds were driven here";
  base = PoseTrack({{{-3 * kSecond}, {1, 0, 0}}, {{0}, {1, 0, 0}}}, "map", true);
  EXPECT_NE(whyNot({0, 0}), "") << "nobody knows where that was";
}

TEST_F(ApproachOf, isBoundedForEachJointAndForAll) {
  rules.accepts_unchecked = true;
  EXPECT_EQ(whyNot({-2.5, 1}),
            "shoulder would have to go 3.50 rad to get there: it goes at most 3.2 rad, or 0.4 m, "
            "by itself; the robot has to be brought nearer");
  const std::vector<std::string> three = {"a", "b", "c"};
  EXPECT_THROW(approach().wayTo(three, {0, 0, 0}, {3, 3, 3}, {0}), ApproachRefused);
  EXPECT_NO_THROW(approach().wayTo(three, {0, 0, 0}, {3, 3, 2}, {0})) << "8 rad";
  EXPECT_NO_THROW(approach().wayTo({"a"}, {0}, {3.2}, {0}));
  EXPECT_EQ(approach().wayTo({"a"}, {0}, {0.2}, {0}).kind, Kind::Short);
  EXPECT_EQ(approach().wayTo({"a"}, {0}, {0.21}, {0}).kind, Kind::Unchecked);
  EXPECT_THROW(approach().wayTo({"torso_lift"}, {0}, {0.41}, {0}), ApproachRefused);
}

TEST_F(ApproachOf, goesNoFasterThanItsLimits) {
  rules.limits.joints["elbow"].velocity = 0.1;
  EXPECT_NEAR(wayFrom({1, 0.9}).seconds(), 1.5 * 0.1 / 0.1, 1e-9);
  EXPECT_NEAR(wayFrom({0.9, 1}).seconds(), 1.5 * 0.1 / 0.3, 1e-9);
}

TEST_F(ApproachOf, followsAJointWithoutAnEndAsManyTurnsOnAsItGoes) {
  RobotJoint elbow;
  elbow.kind = RobotJoint::Kind::Endless;
  rules.robot = RobotJoints("arm", {{"elbow", elbow}, {"shoulder", {}}}, {});
  const JointWay way = approach().wayTo(kJoints, {0, 2 * kPi}, {1, 1 + 2 * kPi}, {0});
  EXPECT_EQ(way.kind, Kind::Recorded);
  for (const JointWay::Rest& rest : way.rests) EXPECT_GT(rest.positions[1], 2 * kPi - 0.01);
}

// ----------------------------------------------------------------- of goals within a behavior

TEST_F(ApproachOf, leadsAGoalOfAReplayToItsFirstPointByTheSameRule) {
  const Approach rule = approach();
  ArmStartOptions options;
  options.elsewhere = ArmStartOptions::Elsewhere::Approach;
  options.approach = &rule;
  Numbers live = {0, 0};
  const ArmStart start(
      track,
      [&](const std::string& joint) { return LiveJoint{live[joint == "elbow" ? 1 : 0], 0}; },
      options);
  const Channel arm = test::trajectoryGoalChannel("/arm/follow_joint_trajectory/goal");
  Value goal = decode(test::schemaOf(arm), test::goalMessage("recorded", {2.0}));
  test::at(goal, "goal.trajectory.joint_names") = Array(kJoints.begin(), kJoints.end());
  Array& points = std::get<Array>(test::at(goal, "goal.trajectory.points"));
  valueAt(points[0], "positions") = numberArray({1.2, 1.2});
  const Bytes bytes = encode(test::schemaOf(arm), goal);

  const double lead = start.leadOf(arm, bytes, {0}).value();
  EXPECT_NEAR(lead, wayFrom({0, 0}).seconds(), 0.05);
  Value begun = decode(test::schemaOf(arm), start.begin(arm, bytes, {0}, lead));
  const Array& way = *trajectoryIn(begun)->points;
  ASSERT_GE(way.size(), 4u) << "where it is, the corner, where it was, the goal's own";
  const JointWay recorded = wayFrom({0, 0});
  for (std::size_t i = 1; i + 1 < recorded.rests.size(); ++i) {
    EXPECT_NEAR(secondsOf(way[i]), recorded.rests[i].at_s, 0.05) << "at the same speed";
  }
  Value late = decode(test::schemaOf(arm), start.begin(arm, bytes, {0}, 2 * lead));
  EXPECT_NEAR(secondsOf((*trajectoryIn(late)->points)[1]), 2 * secondsOf(way[1]), 1e-6)
      << "slower, where there is more time";
  for (std::size_t i = 1; i < way.size(); ++i) {
    EXPECT_GT(timeFromStartNs(way[i]), timeFromStartNs(way[i - 1]));
  }

  const GoalProgress at_its_begin{{0}, {0}, 0};
  const RestNeed need = start.needToGoOn(arm, bytes, at_its_begin).value();
  EXPECT_TRUE(need.is_elsewhere);
  EXPECT_GE(need.seconds, lead);
  Value gone_on = decode(test::schemaOf(arm), start.goOn(arm, bytes, at_its_begin, need.seconds));
  const Array& rest = *trajectoryIn(gone_on)->points;
  EXPECT_NEAR(secondsOf(rest[1]), secondsOf(way[1]), 0.1) << "by the same way";
  bool goes_round = false;
  for (std::size_t i = 1; i < rest.size(); ++i) {
    EXPECT_GT(timeFromStartNs(rest[i]), timeFromStartNs(rest[i - 1]));
    const Numbers there = numbersAt(rest[i], "positions");
    goes_round = goes_round || (std::abs(there[0]) < 0.03 && std::abs(there[1] - 1) < 0.03);
  }
  EXPECT_TRUE(goes_round) << "the elbow first";
  expectNear(numbersAt(rest.back(), "positions"), {1.2, 1.2}, 1e-9);

  live = {1.03, 0.98};
  EXPECT_EQ(start.leadOf(arm, bytes, {0}), 0.0) << "near enough: that is made good on the way";
  EXPECT_FALSE(start.needToGoOn(arm, bytes, at_its_begin).value().is_elsewhere);
  live = {0.5, 0.1};
  EXPECT_THROW(start.leadOf(arm, bytes, {0}), ArmElsewhere) << "from there none was recorded";
}

}  // namespace
}  // namespace afterglow::replay::approach_test
