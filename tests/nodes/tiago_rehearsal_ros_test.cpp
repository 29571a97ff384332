// A TIAGo is recorded and replayed by its profile: through twist_mux, with ros_controllers that
// hold the measured pose after a cancel and go on after an abort.
#include <afterglow/SetRate.h>
#include <gtest/gtest.h>
#include <std_msgs/Bool.h>
#include <std_msgs/String.h>

#include <cmath>
#include <string>
#include <vector>

#include "nodes/player/robot_services.hpp"
#include "tests/support/robots/rehearsal.hpp"

namespace afterglow::nodes::tiago_rehearsal_ros_test {
namespace {

using namespace test;
using replay::PlanarPose;
using State = actionlib::SimpleClientGoalState;

const std::string kArm = "arm_controller", kTorso = "torso_controller",
                  kGripper = "gripper_controller", kBase = "/nav_vel";

std::string goalOf(const std::string& controller) {
  return "/" + controller + "/follow_joint_trajectory/goal";
}

const std::vector<double> kEnd = {0.8, -0.6, 1.2, 0.9, -0.7, 0.5, 0.6};

struct TiagoRehearsal : testing::Test {
  static void SetUpTestSuite() {
    tiago = new Rehearsal("tiago", "tiago", {"_localization_noise/position:=0.01"});
    drive = Rehearsal::record({kBase}, [] {
      tiago->drive(kBase, {{{0.3, 0}, 2}, {{0.2, 0.4}, 1.5}, {{0.3, 0}, 1}});
    });
    drive_end = tiago->witness->pose();
  }
  static void TearDownTestSuite() { delete tiago; }
  TiagoRehearsal() { tiago->putBack(); }

  static control_msgs::FollowJointTrajectoryGoal reach(double path_tolerance = 0) {
    auto goal = trajectoryGoal(tiago->facts.controllers[0].joints,
                               {{1, {0.2, -0.2, 0.3, 0.2, -0.2, 0.1, 0.1}},
                                {2, {0.6, -0.5, 0.9, 0.7, -0.5, 0.4, 0.4}},
                                {3, kEnd}},
                               true);
    for (const std::string& joint : goal.trajectory.joint_names) {
      if (path_tolerance == 0) break;
      goal.path_tolerance.emplace_back();
      goal.path_tolerance.back().name = joint;
      goal.path_tolerance.back().position = path_tolerance;
    }
    return goal;
  }
  static std::int64_t recordReach(double path_tolerance = 0) {
    const std::int64_t behavior = Rehearsal::record({goalOf(kArm)}, [=] {
      EXPECT_EQ(tiago->follower(kArm).sendGoalAndWait(reach(path_tolerance)), State::SUCCEEDED);
    });
    tiago->putBack();
    return behavior;
  }
  static bool armIsUnderWay() { return tiago->witness->joint("arm_3_joint") > 0.4; }
  static bool baseIsUnderWay() { return tiago->witness->pose().x > 0.3; }
  static void expectArmArrived() {
    for (std::size_t i = 0; i < kEnd.size(); ++i) {
      const std::string& joint = tiago->facts.controllers[0].joints[i];
      EXPECT_TRUE(
          eventually([&] { return std::abs(tiago->witness->joint(joint) - kEnd[i]) < 0.005; }))
          << joint << " " << tiago->witness->joint(joint);
    }
  }

  static inline Rehearsal* tiago = nullptr;
  static inline std::int64_t drive = 0;
  static inline PlanarPose drive_end;
};

TEST_F(TiagoRehearsal, reachesLiftsAndGripsWithoutAJoltAndHoldsAtOnceInAPause) {
  const std::int64_t behavior =
      Rehearsal::record({goalOf(kArm), goalOf(kTorso), goalOf(kGripper)}, [] {
        // As pal_gripper's parallel_gripper_controller sends it: without velocities.
        tiago->follower(kGripper).sendGoal(trajectoryGoal(
            tiago->facts.controllers[3].joints, {{1, {0.04, 0.04}}}, false));
        tiago->follower(kTorso).sendGoal(trajectoryGoal({"torso_lift_joint"}, {{3, {0.1}}}, false));
        EXPECT_EQ(tiago->follower(kArm).sendGoalAndWait(reach()), State::SUCCEEDED);
        EXPECT_TRUE(tiago->follower(kTorso).waitForResult(kRobotPatience));
      });
  for (const bool pauses : {false, true}) {
    tiago->putBack();
    tiago->beginReplay(behavior);
    if (pauses) {
      ASSERT_TRUE(eventually(armIsUnderWay)) << tiago->player().log();
      EXPECT_LT(tiago->pause(), 0.4);
      Rehearsal::resume();
    }
    EXPECT_EQ(tiago->endOfReplay(), "");
    expectArmArrived();
    EXPECT_TRUE(eventually(
        [] { return std::abs(tiago->witness->joint("torso_lift_joint") - 0.1) < 0.002; }));
    const std::string& finger = tiago->facts.controllers[3].joints[0];
    EXPECT_TRUE(
        eventually([&] { return std::abs(tiago->witness->joint(finger) - 0.04) < 0.002; }));
    tiago->expectNoJolt();
  }
}

TEST_F(TiagoRehearsal, goesOnWithoutAJoltAtAnotherSpeed) {
  const std::int64_t behavior = recordReach();
  tiago->beginReplay(behavior);
  ASSERT_TRUE(eventually(armIsUnderWay)) << tiago->player().log();
  SetRate::Request half;
  half.rate = 0.5;
  EXPECT_TRUE(callService<SetRate>("/player_node/set_rate", half).success);
  EXPECT_EQ(tiago->endOfReplay(), "");
  expectArmArrived();
  tiago->expectNoJolt();
}

TEST_F(TiagoRehearsal, isHaltedWhereItsControllerGoesOnAfterAnAbort) {
  const std::int64_t behavior = recordReach(0.2);
  tiago->beginReplay(behavior);
  ASSERT_TRUE(eventually(armIsUnderWay)) << tiago->player().log();
  ros::Publisher hand = tiago->node->advertise<std_msgs::String>("/robot/hinder", 1);
  ASSERT_TRUE(eventually([&] { return hand.getNumSubscribers() > 0; }));
  std_msgs::String joint;
  joint.data = "arm_4_joint";
  hand.publish(joint);
  EXPECT_EQ(tiago->endOfReplay(),
            "ABORTED: body failed: a goal on /arm_controller/follow_joint_trajectory/goal was "
            "aborted (PATH_TOLERANCE_VIOLATED, -4), and was not when it was recorded");
  ASSERT_TRUE(eventually([] { return tiago->witness->stands(); }));
  EXPECT_LT(tiago->witness->joint("arm_3_joint"), 1.15) << "of 1.2, where it was led";
}

TEST_F(TiagoRehearsal, isRefusedBeforeAnythingMovesWhereAControllerIsStopped) {
  const std::int64_t behavior = recordReach();
  ros::Publisher person = tiago->node->advertise<std_msgs::String>("/robot/switch_off", 1);
  ASSERT_TRUE(eventually([&] { return person.getNumSubscribers() > 0; }));
  std_msgs::String name;
  name.data = kArm;
  person.publish(name);
  ros::NodeHandle node;
  ASSERT_TRUE(eventually([&] {
    return whyNotRunning(askControllers(askMaster(deadlineIn(5))), goalOf(kArm)) != "";
  }));
  EXPECT_EQ(tiago->replay(behavior),
            "ABORTED: motion is refused: arm_controller is stopped (controller_manager): start it "
            "with `rosrun controller_manager controller_manager start arm_controller`");
  tiago->putBack();
  EXPECT_EQ(whyNotRunning(askControllers(askMaster(deadlineIn(5))), goalOf(kArm)), "");
}

TEST_F(TiagoRehearsal, drivesThroughItsMultiplexerToWhereItHadGone) {
  EXPECT_EQ(tiago->replay(drive), "");
  const PlanarPose is = tiago->witness->pose();
  EXPECT_GT(distance(drive_end, {}), 0.8);
  EXPECT_LT(distance(is, drive_end), 0.03);
  EXPECT_LT(std::abs(replay::wrapAngle(is.yaw - drive_end.yaw)), 0.06);
  EXPECT_LT(tiago->witness->fastestBase(), 0.4);
}

TEST_F(TiagoRehearsal, givesWayToWhoeverTakesItsJoystick) {
  tiago->beginReplay(drive);
  ASSERT_TRUE(eventually(baseIsUnderWay)) << tiago->player().log();
  ros::Publisher joystick = tiago->node->advertise<geometry_msgs::Twist>("/joy_vel", 1);
  ASSERT_TRUE(eventually([&] { return joystick.getNumSubscribers() >= 2; }));
  geometry_msgs::Twist turn;
  turn.angular.z = 0.2;
  joystick.publish(turn);
  // Before its multiplexer or behind it, whichever is heard first.
  EXPECT_EQ(tiago->endOfReplay().find("ABORTED: somebody else drives the base on /"), 0U);
}

TEST_F(TiagoRehearsal, givesWayToAJoystickAtNeutralWhoseZerosItsMultiplexerPassesOn) {
  tiago->beginReplay(drive);
  ASSERT_TRUE(eventually(baseIsUnderWay)) << tiago->player().log();
  ros::Publisher joystick = tiago->node->advertise<geometry_msgs::Twist>("/joy_vel", 1);
  ASSERT_TRUE(eventually([&] { return joystick.getNumSubscribers() >= 2; }));
  ros::WallRate rate(20);
  for (int i = 0; i < 20; ++i, rate.sleep()) joystick.publish(geometry_msgs::Twist());
  EXPECT_EQ(tiago->endOfReplay(), "ABORTED: somebody holds the base still on /joy_vel");
  ASSERT_TRUE(eventually([] { return tiago->witness->stands(); })) << "when its zeros have ended";
}

TEST_F(TiagoRehearsal, endsWhereItsMultiplexerIsLocked) {
  tiago->beginReplay(drive);
  ASSERT_TRUE(eventually(baseIsUnderWay)) << tiago->player().log();
  ros::Publisher lock = tiago->node->advertise<std_msgs::Bool>("/pause_navigation", 1, true);
  std_msgs::Bool shut;
  shut.data = true;
  lock.publish(shut);
  EXPECT_NE(tiago->endOfReplay().find("the base stands, though it is told to move"),
            std::string::npos);
  shut.data = false;
  lock.publish(shut);
  ASSERT_TRUE(eventually([] { return tiago->witness->stands(); })) << "nothing is left to pass on";
}

TEST_F(TiagoRehearsal, isRefusedWhileItsEmergencyStopIsPressed) {
  const std::int64_t behavior = recordReach();
  tiago->press(true);
  ASSERT_TRUE(eventually([&] { return tiago->replay(behavior) != ""; }));
  EXPECT_EQ(tiago->replay(behavior),
            "ABORTED: motion is refused: the emergency stop is pressed "
            "(/power_status:is_emergency)");
}

}  // namespace
}  // namespace afterglow::nodes::tiago_rehearsal_ros_test
