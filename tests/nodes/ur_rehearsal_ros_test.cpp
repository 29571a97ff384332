// An arm of Universal Robots is recorded and replayed by its profile, with the manners of
// ur_robot_driver's scaled controller.
#include <gtest/gtest.h>
#include <std_msgs/Float64.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/robots/rehearsal.hpp"

namespace afterglow::nodes::ur_rehearsal_ros_test {
namespace {

using namespace test;
using State = actionlib::SimpleClientGoalState;

const std::string kArm = "scaled_pos_joint_traj_controller";
const std::string kGoal = "/" + kArm + "/follow_joint_trajectory/goal";
const std::vector<double> kEnd = {0.8, -0.9, 1.1, -0.4, 0.5, 0.2};

/// As MoveIt sends it: the first point is where the arm is.
control_msgs::FollowJointTrajectoryGoal reach(const RobotFacts& facts) {
  return trajectoryGoal(facts.controllers[0].joints,
                        {{0, {0, 0, 0, 0, 0, 0}},
                         {1, {0.2, -0.4, 0.3, -0.1, 0.3, 0.1}},
                         {2, {0.6, -0.8, 0.9, -0.3, 0.5, 0.2}},
                         {3, kEnd}},
                        true);
}

struct UrRehearsal : testing::Test {
  static void SetUpTestSuite() {
    ur = new Rehearsal("ur", "ur");
    reached = Rehearsal::record({kGoal}, [] {
      EXPECT_EQ(ur->follower(kArm).sendGoalAndWait(reach(ur->facts)), State::SUCCEEDED);
    });
  }
  static void TearDownTestSuite() { delete ur; }
  UrRehearsal() { ur->putBack(); }

  static void expectArrived() {
    for (std::size_t i = 0; i < kEnd.size(); ++i) {
      const std::string& joint = ur->facts.controllers[0].joints[i];
      EXPECT_TRUE(eventually([&] { return std::abs(ur->witness->joint(joint) - kEnd[i]) < 0.005; }))
          << joint << " " << ur->witness->joint(joint);
    }
  }
  static bool isUnderWay() { return ur->witness->joint("elbow_joint") > 0.4; }
  static void setSpeedScale(double value) {
    static const ros::Publisher scale =
        ur->node->advertise<std_msgs::Float64>("/robot/speed_scale", 1);
    ASSERT_TRUE(eventually([] { return scale.getNumSubscribers() > 0; }));
    std_msgs::Float64 message;
    message.data = value;
    scale.publish(message);
  }

  static inline Rehearsal* ur = nullptr;
  static inline std::int64_t reached = 0;
};

TEST_F(UrRehearsal, arrivesWithoutAJoltAndPausedInMidMotionWithinItsRamp) {
  EXPECT_EQ(ur->replay(reached), "");
  expectArrived();
  ur->expectNoJolt();

  ur->putBack();
  ur->beginReplay(reached);
  ASSERT_TRUE(eventually(isUnderWay)) << ur->player().log();
  const double stopped = ur->pause();
  EXPECT_GT(stopped, 0.3) << "its controller ramps";
  EXPECT_LT(stopped, 1.0);
  Rehearsal::resume();
  EXPECT_EQ(ur->endOfReplay(), "");
  expectArrived();
  ur->expectNoJolt();
}

TEST_F(UrRehearsal, waitsForAnArmThatItsPendantSlowsDownAndPauses) {
  setSpeedScale(0.5);
  ur->beginReplay(reached);
  ASSERT_TRUE(eventually(isUnderWay)) << ur->player().log();
  setSpeedScale(0);
  ASSERT_TRUE(eventually([] { return ur->witness->stands(); }));
  setSpeedScale(1);
  EXPECT_EQ(ur->endOfReplay(), "");
  expectArrived();
  ur->expectNoJolt();
}

TEST_F(UrRehearsal, isRefusedWhileNoProgramRunsAndStopsForGoodWhenItIsStopped) {
  const std::string program = "/ur_hardware_interface/robot_program_running:!data";
  ur->press(true);
  ASSERT_TRUE(eventually([&] { return ur->replay(reached) != ""; }));
  EXPECT_EQ(ur->replay(reached),
            "ABORTED: motion is refused: the emergency stop is pressed (" + program + ")");
  ur->press(false);
  ur->putBack();
  ur->beginReplay(reached);
  ASSERT_TRUE(eventually(isUnderWay)) << ur->player().log();
  ur->press(true);
  // Its controllers cancel their goals at the same moment.
  EXPECT_NE(ur->endOfReplay().find("the emergency stop was pressed (" + program + ")"),
            std::string::npos);
  ASSERT_TRUE(eventually([] { return ur->witness->stands(); }));
  const double elbow = ur->witness->joint("elbow_joint");
  ur->press(false);
  ros::WallDuration(0.5).sleep();
  EXPECT_NEAR(ur->witness->joint("elbow_joint"), elbow, 0.005) << "nothing goes on by itself";
}

}  // namespace
}  // namespace afterglow::nodes::ur_rehearsal_ros_test
