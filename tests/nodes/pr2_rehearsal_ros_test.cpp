// A PR2 is recorded and replayed by its profile: its base goes sideways, its controllers step to a
// first point, and its gripper lets go when it is canceled.
#include <control_msgs/GripperCommandActionGoal.h>
#include <gtest/gtest.h>
#include <topic_tools/shape_shifter.h>

#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include "tests/support/robots/rehearsal.hpp"
#include "tests/support/ros_bytes.hpp"

namespace afterglow::nodes::pr2_rehearsal_ros_test {
namespace {

using namespace test;
using replay::PlanarPose;
using State = actionlib::SimpleClientGoalState;

const std::string kArm = "r_arm_controller", kBase = "/navigation/cmd_vel";
const std::string kGoal = "/" + kArm + "/follow_joint_trajectory/goal";
const std::string kGripper = "/r_gripper_controller/gripper_action/goal";
const std::vector<double> kEnd = {-0.8, 0.6, -1, -1.2, 2.5, -0.7, -2};

control_msgs::FollowJointTrajectoryGoal reach(const RobotFacts& facts) {
  return trajectoryGoal(facts.controllers[0].joints,
                        {{1, {-0.2, 0.2, -0.3, -0.4, 0.8, -0.2, -0.6}},
                         {2, {-0.6, 0.5, -0.7, -0.9, 1.8, -0.5, -1.4}},
                         {3, kEnd}},
                        true);
}

struct Pr2Rehearsal : testing::Test {
  static void SetUpTestSuite() {
    pr2 = new Rehearsal("pr2", "pr2", {"_localization_noise/position:=0.01"});
  }
  static void TearDownTestSuite() { delete pr2; }
  Pr2Rehearsal() { pr2->putBack(); }

  static std::int64_t record(const std::vector<std::string>& topics,
                             const std::function<void()>& perform) {
    const std::int64_t behavior = Rehearsal::record(topics, perform);
    pr2->putBack();
    return behavior;
  }
  static void reachAsRecorded() {
    EXPECT_EQ(pr2->follower(kArm).sendGoalAndWait(reach(pr2->facts)), State::SUCCEEDED);
  }
  static bool isUnderWay() { return pr2->witness->joint("r_elbow_flex_joint") < -0.5; }
  static void expectArmArrived() {
    for (std::size_t i = 0; i < kEnd.size(); ++i) {
      const std::string& joint = pr2->facts.controllers[0].joints[i];
      const auto off = [&] {
        return std::abs(replay::wrapAngle(pr2->witness->joint(joint) - kEnd[i]));
      };
      EXPECT_TRUE(eventually([&] { return off() < 0.005; })) << joint << " " << off();
    }
  }
  /// As a client of Pr2GripperCommandAction sends it.
  static void close(double gap) {
    control_msgs::GripperCommandActionGoal goal;
    goal.goal_id.id = "close";
    goal.goal.command.position = gap;
    goal.goal.command.max_effort = 30;
    const replay::Channel channel = rosChannel<control_msgs::GripperCommandActionGoal>(kGripper);
    const std::string definition =
        std::regex_replace(channel.definition, std::regex("(control_msgs/)?GripperCommand"),
                           "pr2_controllers_msgs/Pr2GripperCommand");
    topic_tools::ShapeShifter message;
    message.morph(channel.md5, "pr2_controllers_msgs/Pr2GripperCommandActionGoal", definition, "");
    replay::Bytes bytes = rosBytes(goal);
    ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    message.read(stream);
    ros::Publisher publisher = message.advertise(*pr2->node, kGripper, 1);
    ASSERT_TRUE(eventually([&] { return publisher.getNumSubscribers() >= 2; }))
        << "and the recorder";
    publisher.publish(message);
    ASSERT_TRUE(eventually(
        [&] { return std::abs(pr2->witness->joint("r_gripper_joint") - gap) < 1e-6; }));
  }

  static inline Rehearsal* pr2 = nullptr;
};

TEST_F(Pr2Rehearsal, slidesAndTurnsToWhereItHadGone) {
  PlanarPose end;
  const std::int64_t behavior = record({kBase}, [&] {
    pr2->drive(kBase, {{{0, 0, 0.25}, 1.5}, {{0.2, 0.4, -0.2}, 1.5}, {{0, 0, -0.25}, 1}});
    end = pr2->witness->pose();
  });
  EXPECT_GT(std::abs(end.yaw), 0.4);
  EXPECT_EQ(pr2->replay(behavior), "");
  EXPECT_EQ(pr2->report().find("footprint is not known"), std::string::npos) << pr2->report();
  const PlanarPose is = pr2->witness->pose();
  EXPECT_LT(distance(is, end), 0.03);
  EXPECT_LT(std::abs(replay::wrapAngle(is.yaw - end.yaw)), 0.03);
  EXPECT_LT(pr2->witness->fastestBase(), 0.5);
}

TEST_F(Pr2Rehearsal, endsWhereSomebodySendsZerosBehindItsMultiplexer) {
  const std::int64_t behavior =
      record({kBase}, [] { pr2->drive(kBase, {{{0.2, 0, 0}, 3}}); });
  // As pr2_teleop sends them all the time, though a neutral joystick drives nothing.
  ros::Publisher teleop =
      pr2->node->advertise<geometry_msgs::Twist>("/base_controller/command", 1);
  const auto sendsZerosUntilItEnds = [&] {
    return eventually([&] {
      teleop.publish(geometry_msgs::Twist());
      return pr2->replayer->getState().isDone();
    });
  };
  pr2->beginReplay(behavior);
  ASSERT_TRUE(eventually([] { return pr2->witness->pose().x > 0.1; })) << pr2->player().log();
  EXPECT_TRUE(sendsZerosUntilItEnds()) << pr2->player().log();
  EXPECT_NE(pr2->endOfReplay().find(" drives the base on /base_controller/command"),
            std::string::npos);
  EXPECT_LT(pr2->witness->pose().x, 0.5);

  pr2->putBack();
  pr2->beginReplay(behavior);
  EXPECT_TRUE(sendsZerosUntilItEnds()) << pr2->player().log();
  EXPECT_NE(pr2->endOfReplay().find("motion is refused: "), std::string::npos);
  EXPECT_LT(std::abs(pr2->witness->pose().x), 0.01);
}

TEST_F(Pr2Rehearsal, reachesWithoutAJoltAndHoldsAtOnceInAPause) {
  const std::int64_t behavior = record({kGoal}, reachAsRecorded);
  EXPECT_EQ(pr2->replay(behavior), "");
  expectArmArrived();
  pr2->expectNoJolt();

  pr2->putBack();
  pr2->beginReplay(behavior);
  ASSERT_TRUE(eventually(isUnderWay)) << pr2->player().log();
  EXPECT_LT(pr2->pause(), 0.4);
  Rehearsal::resume();
  EXPECT_EQ(pr2->endOfReplay(), "");
  expectArmArrived();
  pr2->expectNoJolt();
}

TEST_F(Pr2Rehearsal, turnsBackInFullSwingWithoutAJolt) {
  Follower& arm = pr2->follower(kArm);
  const std::vector<std::string>& joints = pr2->facts.controllers[0].joints;
  const std::vector<double> aside = {-1.6, 0, 0, 0, 0, 0, 0}, back = {-0.4, 0, 0, 0, 0, 0, 0};
  const auto pan = [] { return pr2->witness->joint("r_shoulder_pan_joint"); };
  const std::int64_t behavior = record({kGoal}, [&] {
    arm.sendGoal(trajectoryGoal(joints, {{1.5, aside}}, true));
    ASSERT_TRUE(eventually([&] { return pan() < -0.6; }));
    // As MoveIt sends it: from where the arm is thought to be. It swings on a little and turns.
    const std::vector<double> begin = {pan(), 0, 0, 0, 0, 0, 0};
    EXPECT_EQ(arm.sendGoalAndWait(trajectoryGoal(joints, {{0, begin}, {3, back}}, true)),
              State::SUCCEEDED);
  });
  EXPECT_EQ(pr2->replay(behavior), "");
  EXPECT_NEAR(pan(), back[0], 0.005);
  pr2->expectNoJolt();
}

TEST_F(Pr2Rehearsal, neverLetsGoOfWhatItsGripperHolds) {
  const std::int64_t behavior = record({kGripper}, [] { close(0.08); });
  pr2->beginReplay(behavior);
  ASSERT_TRUE(eventually([] { return pr2->witness->joint("r_gripper_joint") > 0.02; }))
      << pr2->player().log();
  pr2->pause();
  EXPECT_NEAR(pr2->witness->joint("r_gripper_joint"), 0.08, 1e-6) << "0.086 would be limp";
  Rehearsal::resume();
  EXPECT_EQ(pr2->endOfReplay(), "");
}

TEST_F(Pr2Rehearsal, isNotMovedWhileItsRunStopIsPressedNorOnceItIsReleased) {
  const std::int64_t behavior = record({kGoal}, reachAsRecorded);
  const std::string stop = "(/power_board/state:!run_stop)";
  pr2->beginReplay(behavior);
  ASSERT_TRUE(eventually(isUnderWay)) << pr2->player().log();
  pr2->press(true);
  EXPECT_EQ(pr2->endOfReplay(), "ABORTED: the emergency stop was pressed " + stop);
  EXPECT_EQ(pr2->replay(behavior), "ABORTED: motion is refused: the emergency stop is pressed " +
                                       stop);
  ASSERT_TRUE(eventually([] { return pr2->witness->stands(); }));
  const double elbow = pr2->witness->joint("r_elbow_flex_joint");
  pr2->witness->forget();
  pr2->press(false);
  // Its controllers have gone on without power: what they were not told to hold, they would reach.
  ros::WallDuration(0.5).sleep();
  EXPECT_NEAR(pr2->witness->joint("r_elbow_flex_joint"), elbow, 0.005);
}

}  // namespace
}  // namespace afterglow::nodes::pr2_rehearsal_ros_test
