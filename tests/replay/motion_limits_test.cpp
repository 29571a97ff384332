// The one gate for speed: what no robot is told, at whatever rate, and what a higher rate breaks.
#include "replay/motion/motion_limits.hpp"

#include <gtest/gtest.h>

#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/joint_track.hpp"
#include "tests/support/player_world.hpp"

namespace afterglow::replay::motion_limits_test {
namespace {

using namespace test;

const std::string kElbow = "elbow_flex_joint";
const Channel kJointStates = channelOf(
    "/joint_states", "sensor_msgs/JointState",
    withTypes("Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
              "float64[] effort\n",
              "std_msgs/Header", kHeader));

struct Point {
  double at_s;
  double position;
};

/// A goal of one joint.
Bytes goalOf(const std::string& joint, const std::vector<Point>& points) {
  const Schema schema = schemaOf(kArm);
  Value goal = decode(schema, goalMessage("a", std::vector<double>(points.size())));
  test::at(goal, "goal.trajectory.joint_names") = Array{joint};
  Array& array = std::get<Array>(test::at(goal, "goal.trajectory.points"));
  for (std::size_t i = 0; i < points.size(); ++i) {
    valueAt(array[i], "positions") = numberArray({points[i].position});
    valueAt(array[i], "velocities") = numberArray({});
    valueAt(array[i], "time_from_start") =
        toRosDuration(static_cast<std::int64_t>(points[i].at_s * 1e9));
  }
  return encode(schema, goal);
}

/// What a Fetch's profile says.
RobotProfile fetch() {
  RobotProfile profile;
  profile.base.fastest = 1;
  profile.base.fastest_turn = 4.5;
  profile.base.linear_acceleration = 0.75;
  profile.joints[kElbow].velocity = 1.521;
  profile.joints["shoulder_lift_joint"] = {1.454, {}, {{-1.221, 1.518}}};
  return profile;
}

struct Gate : PlayerWorld {
  MotionLimits limits = boundedBy({}, {}, fetch());
  RobotJoints robot;
  bool is_base_timed = false;

  void recordJoint(std::int64_t from_ms, std::int64_t to_ms, const std::string& joint,
                   double position) {
    const std::vector<std::string> own = topics;
    Value state = blank(kJointStates);
    test::at(state, "name") = Array{joint};
    test::at(state, "position") = numberArray({position});
    for (std::int64_t ms = from_ms; ms <= to_ms; ms += 50) {
      record(kJointStates, ms, encode(schemaOf(kJointStates), state));
    }
    topics = own;
  }
  /// Of what was recorded; empty: it passes.
  std::string whyNot(double rate = 1) {
    if (plan.topics.empty()) play(5000);
    try {
      return whyTooFast(motionPeaks(*store, plan, limits, robot, is_base_timed), rate);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }
};

TEST_F(Gate, refusesAtRateOneWhatTheRobotCannotDoThoughItWasRecorded) {
  record(kCmdVel, 0, twist(0.5));
  record(kCmdVel, 700, twist(5));
  EXPECT_EQ(whyNot(),
            "/cmd_vel: linear velocity of 5 m/s at rate 1, 0.7 s into the behavior, is above the "
            "limit of 1");
}

TEST_F(Gate, refusesABaseAtTheSpeedOfNumbersWhoeverItIs) {
  record(kCmdVel, 0, twist(1e300));
  limits = {};
  EXPECT_NE(whyNot().find("linear velocity of 1e+300 m/s"), std::string::npos) << whyNot();
  EXPECT_NE(whyNot().find("is above the limit of 3, which holds for robots"), std::string::npos);
}

TEST_F(Gate, refusesAJointThatIsFasterThanItCanBe) {
  record(kArm, 1000, goalOf(kElbow, {{0.1, 0}, {0.2, 2}}));
  EXPECT_NE(whyNot().find("velocity of elbow_flex_joint of 20 rad/s or m/s at rate 1, 1.2 s"),
            std::string::npos)
      << whyNot();
}

TEST_F(Gate, lowersItsLimitsByWhatIsAskedForAndNeverRaisesThem) {
  record(kCmdVel, 0, twist(1.2));
  MotionLimits wanted;
  wanted.linear = 9;
  limits = boundedBy(wanted, {}, fetch());
  EXPECT_NE(whyNot().find("is above the limit of 1"), std::string::npos) << whyNot();
  wanted.linear = 0.4;
  limits = boundedBy(wanted, {}, fetch());
  EXPECT_NE(whyNot().find("is above the limit of 0.4"), std::string::npos) << whyNot();
}

TEST_F(Gate, letsARobotDoAgainWhatItDidAFewPercentBeyondALimit) {
  record(kCmdVel, 0, twist(1.04));
  is_base_timed = true;
  EXPECT_EQ(whyNot(), "");
  EXPECT_EQ(whyNot(1.01),
            "/cmd_vel: linear velocity of 1.05 m/s at rate 1.01, 0 s into the behavior, is above "
            "the limit of 1");
}

TEST_F(Gate, letsAJointOfUnknownLimitsBeFivePercentFasterThanItWas) {
  record(kArm, 0, goalOf("tail_joint", {{1, 0.5}, {2, 1.4}}));
  EXPECT_EQ(whyNot(1.04), "");
  EXPECT_NE(whyNot(1.1).find("what it may do is not known"), std::string::npos) << whyNot(1.1);
  limits.other_joints = {9.0, {}, {}};
  EXPECT_EQ(whyNot(1.1), "");
}

TEST_F(Gate, refusesAPositionBeyondAJointsRange) {
  record(kArm, 500, goalOf("shoulder_lift_joint", {{10, 9.2}}));
  EXPECT_EQ(whyNot(), kArm.topic +
                          ": shoulder_lift_joint would go to 9.2, and its range is -1.221 to "
                          "1.518, 10.5 s into the behavior");
}

TEST_F(Gate, takesAPositionAtTheEndOfARangeAndAnyOfAJointThatTurnsWithoutAnEnd) {
  record(kArm, 0, goalOf("shoulder_lift_joint", {{5, 1.518 + 0.02}, {9, -1.221 - 0.02}}));
  record(kArm, 10, goalOf("wrist_roll_joint", {{20, 9.2}}));
  EXPECT_EQ(whyNot(), "");
}

/// Such a goal is refused when it is sent; what there is of it is looked at.
TEST_F(Gate, bearsAGoalWhosePointsHaveOtherNumbersThanItHasJoints) {
  for (const std::vector<double>& positions : {std::vector<double>{}, {0.1}, {0.1, 0.2, 0.3}}) {
    const Schema schema = schemaOf(kArm);
    Value goal = decode(schema, goalOf(kElbow, {{1, 0}, {2, 0.1}}));
    test::at(goal, "goal.trajectory.joint_names") = Array{kElbow, std::string("wrist_roll_joint")};
    Array& points = std::get<Array>(test::at(goal, "goal.trajectory.points"));
    valueAt(points[1], "positions") = numberArray(positions);
    valueAt(points[1], "velocities") = numberArray(positions);
    record(kArm, 0, encode(schema, goal));
  }
  EXPECT_EQ(whyNot(), "");
}

TEST_F(Gate, refusesTimesThatDoNotRise) {
  record(kArm, 500, goalOf(kElbow, {{1, 0}, {1, 0.1}}));
  EXPECT_EQ(whyNot(), kArm.topic +
                          ": points[1] is due at 1 s, the one before it at 1 s: times have to "
                          "rise, 0.5 s into the behavior");
}

TEST_F(Gate, refusesTimesThatRunBackward) {
  record(kArm, 0, goalOf(kElbow, {{2, 0}, {1, 0.1}}));
  EXPECT_NE(whyNot().find("times have to rise"), std::string::npos) << whyNot();
}

TEST_F(Gate, refusesATimeBeforeTheTrajectoryBegins) {
  record(kArm, 0, goalOf(kElbow, {{-1, 0}, {1, 0.1}}));
  EXPECT_NE(whyNot().find("points[0] is due at -1 s, before the trajectory begins"),
            std::string::npos)
      << whyNot();
}

TEST_F(Gate, refusesARadianInNoTime) {
  recordJoint(0, 2000, kElbow, 0);
  record(kArm, 1000, goalOf(kElbow, {{0, 1}}));
  EXPECT_EQ(whyNot(), kArm.topic +
                          ": elbow_flex_joint would go from 0 to 1 in 0 s, 1 s into the behavior");
}

TEST_F(Gate, takesAFirstPointThatIsDueAtOnceWhereTheJointIs) {
  recordJoint(0, 2000, kElbow, 0);
  record(kArm, 1000, goalOf(kElbow, {{0, 0.1}, {1, 1}}));
  EXPECT_EQ(whyNot(), "");
}

TEST_F(Gate, looksAtTheWayToTheFirstPoint) {
  recordJoint(0, 2000, kElbow, 0);
  record(kArm, 1000, goalOf(kElbow, {{0.1, 1}, {2, 1.1}}));
  EXPECT_NE(whyNot().find("velocity of elbow_flex_joint of 10 "), std::string::npos) << whyNot();
}

TEST_F(Gate, doesNotTakeASlideForATurn) {
  limits.other_joints.velocity = 1;
  recordJoint(0, 2000, "torso_lift_joint", 0);
  recordJoint(0, 2000, "wrist_roll_joint", 0);
  record(kArm, 1000, goalOf("wrist_roll_joint", {{1, 6.3}, {2, 6.4}}));
  record(kArm, 1100, goalOf("torso_lift_joint", {{1, 6.3}, {2, 6.4}}));
  EXPECT_NE(whyNot().find("velocity of torso_lift_joint of 6.3 "), std::string::npos) << whyNot();
}

TEST_F(Gate, looksAtAGoalThatIsUnderWayWhereTheReplayBegins) {
  record(kArm, 0, goalOf(kElbow, {{1, 0}, {1.1, 2}}));
  record(kArm, 3000, goalOf(kElbow, {{1, 0}}));
  play(5000);
  plan.begin = {kBegin + 1050 * kMs};
  EXPECT_NE(whyNot(), "");
  plan.begin = {kBegin + 1150 * kMs};
  EXPECT_EQ(whyNot(), "") << "it was over";
}

TEST_F(Gate, refusesARateAtWhichABaseInOpenLoopCouldNotRamp) {
  for (int i = 0; i <= 10; ++i) record(kCmdVel, i * 100, twist(0.05 * i));  // 0.5 m/s^2
  EXPECT_EQ(whyNot(), "");
  EXPECT_EQ(whyNot(1.2), "");
  EXPECT_NE(whyNot(1.5).find("linear acceleration of 1.125 m/s^2 at rate 1.5"), std::string::npos)
      << whyNot(1.5);
  is_base_timed = true;
  EXPECT_EQ(whyNot(1.5), "") << "its drive is timed anew";
}

/// A twist of a base that goes sideways and turns, too.
Bytes anyTwist(double forward, double left, double turn) {
  Value message = blank(kCmdVel);
  for (const char* zero : {"linear.z", "angular.x", "angular.y"}) test::at(message, zero) = 0.0;
  test::at(message, "linear.x") = forward;
  test::at(message, "linear.y") = left;
  test::at(message, "angular.z") = turn;
  return encode(schemaOf(kCmdVel), message);
}

TEST_F(Gate, looksAtTheRampsOfABaseInEveryDirectionAndAtNoneOfASteadyOne) {
  limits.angular_acceleration = 2;
  for (int i = 0; i <= 10; ++i) record(kCmdVel, i * 100, anyTwist(0.05, -0.05, 0.2));
  EXPECT_EQ(whyNot(1.4), "");
  record(kCmdVel, 1100, anyTwist(0.05, -0.11, 0.2));
  EXPECT_NE(whyNot(1.4).find("linear acceleration of"), std::string::npos) << whyNot(1.4);
}

TEST_F(Gate, looksAtTheRampsOfABaseThatTurns) {
  limits.angular_acceleration = 2;
  for (int i = 0; i <= 10; ++i) record(kCmdVel, i * 100, anyTwist(0, 0, 0.15 * i));
  EXPECT_EQ(whyNot(1.1), "");
  EXPECT_NE(whyNot(1.3).find("angular acceleration of"), std::string::npos) << whyNot(1.3);
}

TEST_F(Gate, takesABaseInOpenLoopThatWasToldToStandAtOnceAtTheSameRate) {
  record(kCmdVel, 0, twist(0.8));
  record(kCmdVel, 1000, twist(0));
  EXPECT_EQ(whyNot(), "");
  EXPECT_NE(whyNot(1.1), "");
}

RobotJoints described() {
  return {"odd",
          {{"torso_turn", {RobotJoint::Kind::Turning, 1.5, {}, JointRange{-1, 1}}},
           {"slider", {RobotJoint::Kind::Sliding, 0.02, {}}},
           {"wheel", {RobotJoint::Kind::Endless, {}, {}}}},
          {"slider"}};
}

TEST(MotionLimits, areTheLowestOfWhatIsAskedForAndDescribedAndThenTheProfiles) {
  RobotProfile profile;
  profile.base.fastest = 1;
  profile.base.deceleration = 0.6;
  profile.joints["torso_turn"] = {9, 3, {{-9, 9}}};
  profile.joints["unheard_of"].velocity = 0.5;
  profile.joints["slider"].range = {0, 0.4};
  profile.joints["wheel"].range = {0, 1};
  MotionLimits asked;
  asked.angular = 0.4;
  asked.joints["slider"].velocity = 0.01;
  const MotionLimits limits = boundedBy(asked, described(), profile);
  EXPECT_EQ(limits.linear, 1);
  EXPECT_EQ(limits.angular, 0.4);
  EXPECT_EQ(limits.linear_acceleration, 0.6) << "as it brakes, where its ramps are not known";
  EXPECT_EQ(limits.joints.at("slider").velocity, 0.01) << "asked for";
  EXPECT_EQ(limits.joints.at("torso_turn").velocity, 1.5) << "described, before the profile";
  EXPECT_EQ(limits.joints.at("torso_turn").acceleration, 3);
  EXPECT_EQ(limits.joints.at("torso_turn").range, (JointRange{-1, 1}));
  EXPECT_EQ(limits.joints.at("slider").range, (JointRange{0, 0.4}));
  EXPECT_EQ(limits.joints.at("unheard_of").velocity, 0.5);
  EXPECT_EQ(limits.joints.count("wheel"), 0u) << "it has no end";
}

TEST(MotionLimits, keepTheLimitThatHoldsForAllOthers) {
  MotionLimits asked;
  asked.other_joints.velocity = 0.2;
  EXPECT_EQ(boundedBy(asked, described(), {}).joints.at("torso_turn").velocity, 0.2);
}

}  // namespace
}  // namespace afterglow::replay::motion_limits_test
