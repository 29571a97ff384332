// What kind of joints a robot has, and how fast they may go.
#include "replay/motion/robot_joints.hpp"

#include <gtest/gtest.h>

#include "replay/motion/arm/start_pose.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay::robot_joints_test {
namespace {

using Kind = RobotJoint::Kind;

/// A robot whose names say the opposite of what its description says.
RobotJoints odd() {
  return {"odd",
          {{"torso_turn", {Kind::Turning, 1.5, {}}},
           {"slider", {Kind::Sliding, 0.02, {}}},
           {"wheel", {Kind::Endless, {}, {}}},
           {"shadow", {Kind::Sliding, {}, MimicJoint{"slider", 2, 0.1}}}},
          {"slider"}};
}

TEST(RobotJoints, areAsTheDescriptionSaysWhateverTheirNames) {
  const RobotJoints joints = odd();
  EXPECT_FALSE(joints.isSliding("torso_turn"));
  EXPECT_TRUE(joints.isSliding("slider"));
  EXPECT_TRUE(joints.isEndless("wheel"));
  EXPECT_TRUE(joints.isGripper("slider")) << "the profile says so";
  EXPECT_FALSE(joints.isGripper("finger"));
  ASSERT_TRUE(joints.mimicOf("shadow"));
  EXPECT_EQ(joints.mimicOf("shadow")->other, "slider");
  EXPECT_FALSE(joints.mimicOf("slider"));
}

TEST(RobotJoints, areTakenByTheirNamesWithoutADescription) {
  const RobotJoints joints;
  EXPECT_FALSE(joints.isDescribed());
  EXPECT_TRUE(joints.isSliding("torso_lift_joint"));
  EXPECT_TRUE(joints.isGripper("l_gripper_finger_joint"));
  EXPECT_FALSE(joints.isSliding("elbow_flex_joint"));
  EXPECT_FALSE(joints.isEndless("wrist_roll_joint"));
}

TEST(RobotJoints, goTheShortWayRoundOnlyWhereTheyTurnWithoutAnEnd) {
  EXPECT_NEAR(odd().way("wheel", 3.1, -3.1), 2 * kPi - 6.2, 1e-9);
  EXPECT_NEAR(odd().way("torso_turn", 3.1, -3.1), -6.2, 1e-9);
  EXPECT_NEAR(RobotJoints().way("wrist_roll_joint", 3.1, -3.1), -6.2, 1e-9);
}

TEST(RobotJoints, areNotCheckedWhereTheyOnlyFollowOthers) {
  StartPose then;
  then.robot = odd();
  then.joints = {{"slider", 0.1}, {"shadow", 0.3}};
  StartPose now;
  now.joints = {{"slider", 0.1}};
  EXPECT_TRUE(jointDeviations(then, now, {}).empty());
}

TEST(RobotJoints, areApproachedNoFasterThanTheyMayGo) {
  const ApproachSpeed speed;
  EXPECT_EQ(speed.of(odd(), "slider"), 0.02);
  EXPECT_EQ(speed.of(odd(), "torso_turn"), speed.turning);
  EXPECT_EQ(speed.of(odd(), "shadow"), speed.sliding);
}

}  // namespace
}  // namespace afterglow::replay::robot_joints_test
