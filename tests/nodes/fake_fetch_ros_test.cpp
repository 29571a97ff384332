#include <actionlib/client/simple_action_client.h>
#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/JointState.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <stdexcept>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/fetch/fake_fetch_node.hpp"
#include "nodes/fetch/fetch_facts.hpp"
#include "tests/support/fetch_poses.hpp"
#include "tests/support/ros_master.hpp"

namespace afterglow::nodes::fake_fetch_ros_test {
namespace {

using control_msgs::FollowJointTrajectoryAction;
using control_msgs::FollowJointTrajectoryGoal;
using control_msgs::FollowJointTrajectoryResult;
using test::eventually;
using TrajectoryClient = actionlib::SimpleActionClient<FollowJointTrajectoryAction>;
using State = actionlib::SimpleClientGoalState;

const ros::Duration kPatience(20);

/// A graph, the robot and everything that listens to it, once for all tests.
class World {
 public:
  World() {
    node = std::make_unique<ros::NodeHandle>();
    std::stringstream urdf;
    urdf << std::ifstream("assets/fetch.urdf").rdbuf();
    node->setParam("/robot_description", urdf.str());
    node->setParam("/fake_fetch/x", 1.0);
    node->setParam("/fake_fetch/yaw", 0.5);
    model = readRobotDescription(*node);
    robot = std::make_unique<FakeFetchNode>(*model, readFakeFetchConfig(ros::NodeHandle("~")));
    tf_listener = std::make_unique<tf2_ros::TransformListener>(tf);
    joints_subscriber = node->subscribe("/joint_states", 50, &World::onJoints, this);
    odometry_subscriber = node->subscribe("/odom", 50, &World::onOdometry, this);
    spinner.start();
  }
  ~World() { spinner.stop(); }

  double joint(const std::string& name) {
    const std::lock_guard<std::mutex> lock(mutex);
    return positions.count(name) ? positions.at(name) : NAN;
  }
  nav_msgs::Odometry odometry() {
    const std::lock_guard<std::mutex> lock(mutex);
    return last_odometry;
  }
  Eigen::Isometry3d T_map(const std::string& link) {
    return toIsometry(tf.lookupTransform("map", link, ros::Time(0), kPatience).transform);
  }

  test::TestGraph graph{"fake_fetch"};
  std::unique_ptr<ros::NodeHandle> node;
  std::optional<RobotModel> model;
  std::unique_ptr<FakeFetchNode> robot;
  tf2_ros::Buffer tf;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener;

 private:
  void onJoints(const sensor_msgs::JointState& message) {
    const std::lock_guard<std::mutex> lock(mutex);
    for (std::size_t i = 0; i < message.name.size(); ++i)
      positions[message.name[i]] = message.position[i];
  }
  void onOdometry(const nav_msgs::Odometry& message) {
    const std::lock_guard<std::mutex> lock(mutex);
    last_odometry = message;
  }

  std::mutex mutex;
  std::map<std::string, double> positions;
  nav_msgs::Odometry last_odometry;
  ros::Subscriber joints_subscriber, odometry_subscriber;
  ros::AsyncSpinner spinner{2};
};

class FakeFetchNodeTest : public testing::Test {
 public:
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() {
    delete world;
    ros::shutdown();
  }
  void SetUp() override { callReset(); }

  static void callReset() {
    std_srvs::Trigger reset;
    ASSERT_TRUE(ros::service::waitForService("/fake_fetch/reset", kPatience));
    ASSERT_TRUE(ros::service::call("/fake_fetch/reset", reset));
    ASSERT_TRUE(reset.response.success);
    // What was on its way when the robot was reset still arrives.
    ASSERT_TRUE(eventually([] {
      return (world->T_map("base_link").translation() - Eigen::Vector3d(1, 0, 0)).norm() < 1e-6 &&
             std::abs(world->joint("torso_lift_joint")) < 1e-6;
    }));
  }
  static FollowJointTrajectoryGoal torsoGoal(double height, double seconds) {
    FollowJointTrajectoryGoal goal;
    goal.trajectory.joint_names = {"torso_lift_joint"};
    goal.trajectory.points.resize(1);
    goal.trajectory.points[0].positions = {height};
    goal.trajectory.points[0].time_from_start = ros::Duration(seconds);
    return goal;
  }
  /// Drives until the condition holds, then lets the base time out.
  template <typename Condition>
  static bool driveUntil(double linear, const Condition& condition) {
    ros::Publisher wheels = world->node->advertise<geometry_msgs::Twist>("/cmd_vel", 1);
    geometry_msgs::Twist twist;
    twist.linear.x = linear;
    return eventually([&] {
      wheels.publish(twist);
      return condition();
    });
  }

  static World* world;
};
World* FakeFetchNodeTest::world = nullptr;

TEST_F(FakeFetchNodeTest, offersEveryLinkFromMapWhereItsModelHasIt) {
  JointPositions positions;
  for (const Joint& joint : world->model->joints()) {
    if (!joint.moves()) continue;
    ASSERT_TRUE(eventually([&] { return std::isfinite(world->joint(joint.name)); })) << joint.name;
    positions[joint.name] = world->joint(joint.name);
  }
  const Eigen::Isometry3d T_map_base = world->T_map("base_link");
  EXPECT_NEAR(T_map_base.translation().x(), 1, 1e-6);
  for (const auto& [link, T_base_link] : test::linkPoses(*world->model, positions))
    EXPECT_TRUE(world->T_map(link).isApprox(T_map_base * T_base_link, 1e-4)) << link;
}

TEST_F(FakeFetchNodeTest, executesTheSameGoalTwiceInARow) {
  TrajectoryClient torso("/torso_controller/follow_joint_trajectory", true);
  ASSERT_TRUE(torso.waitForServer(kPatience));
  for (int i = 0; i < 2; ++i) {
    callReset();
    EXPECT_EQ(torso.sendGoalAndWait(torsoGoal(0.02, 0.3), kPatience), State::SUCCEEDED);
    EXPECT_TRUE(
        eventually([&] { return std::abs(world->joint("torso_lift_joint") - 0.02) < 1e-3; }));
  }
}

TEST_F(FakeFetchNodeTest, movesItsArmAndProjector) {
  TrajectoryClient arm("/arm_with_torso_controller/follow_joint_trajectory", true);
  ASSERT_TRUE(arm.waitForServer(kPatience));
  FollowJointTrajectoryGoal goal;
  goal.trajectory.points.resize(1);
  for (const std::string& name : kArmWithTorsoJoints) {
    goal.trajectory.joint_names.push_back(name);
    goal.trajectory.points[0].positions.push_back(tuckedArm().at(name) * 0.9);
  }
  goal.trajectory.points[0].time_from_start = ros::Duration(0.3);
  EXPECT_EQ(arm.sendGoalAndWait(goal, kPatience), State::SUCCEEDED);

  TrajectoryClient turret("/projector/follow_joint_trajectory", true);
  ASSERT_TRUE(turret.waitForServer(kPatience));
  goal.trajectory.joint_names = {"projector_tilt_joint", "projector_pan_joint"};
  goal.trajectory.points[0].positions = {0.2, -0.1};
  EXPECT_EQ(turret.sendGoalAndWait(goal, kPatience), State::SUCCEEDED);
  EXPECT_TRUE(
      eventually([&] { return std::abs(world->joint("projector_pan_joint") + 0.1) < 1e-6; }));
}

TEST_F(FakeFetchNodeTest, abortsGoalsForForeignJoints) {
  TrajectoryClient torso("/torso_controller/follow_joint_trajectory", true);
  ASSERT_TRUE(torso.waitForServer(kPatience));
  FollowJointTrajectoryGoal goal = torsoGoal(0.1, 0.3);
  goal.trajectory.joint_names = {"elbow_flex_joint"};
  EXPECT_EQ(torso.sendGoalAndWait(goal, kPatience), State::ABORTED);
  EXPECT_EQ(torso.getResult()->error_code, FollowJointTrajectoryResult::INVALID_JOINTS);
  EXPECT_NEAR(world->joint("torso_lift_joint"), 0, 1e-6);
}

TEST_F(FakeFetchNodeTest, abortsALateGoalAndGoesThereAllTheSame) {
  TrajectoryClient torso("/torso_controller/follow_joint_trajectory", true);
  ASSERT_TRUE(torso.waitForServer(kPatience));
  FollowJointTrajectoryGoal goal = torsoGoal(0.1, 0.3);
  goal.trajectory.header.stamp = ros::Time::now() - ros::Duration(3600);
  EXPECT_EQ(torso.sendGoalAndWait(goal, kPatience), State::ABORTED);
  EXPECT_EQ(torso.getResult()->error_code, FollowJointTrajectoryResult::GOAL_TOLERANCE_VIOLATED);
  EXPECT_TRUE(eventually([] { return std::abs(world->joint("torso_lift_joint") - 0.1) < 1e-6; }));
}

TEST_F(FakeFetchNodeTest, abortsAGoalForJointsThatAnotherControllerIsBusyWith) {
  TrajectoryClient arm("/arm_with_torso_controller/follow_joint_trajectory", true);
  TrajectoryClient torso("/torso_controller/follow_joint_trajectory", true);
  ASSERT_TRUE(arm.waitForServer(kPatience) && torso.waitForServer(kPatience));
  FollowJointTrajectoryGoal goal;
  goal.trajectory.points.resize(1);
  for (const std::string& name : kArmWithTorsoJoints) {
    goal.trajectory.joint_names.push_back(name);
    goal.trajectory.points[0].positions.push_back(test::armOverTable().at(name));
  }
  goal.trajectory.points[0].time_from_start = ros::Duration(60);
  arm.sendGoal(goal);
  ASSERT_TRUE(eventually([] { return world->joint("torso_lift_joint") > 1e-4; }));
  EXPECT_EQ(torso.sendGoalAndWait(torsoGoal(0.02, 0.3), kPatience), State::ABORTED);
  EXPECT_EQ(torso.getResult()->error_code, FollowJointTrajectoryResult::GOAL_TOLERANCE_VIOLATED);
  EXPECT_EQ(arm.getState(), State::ACTIVE);
}

TEST_F(FakeFetchNodeTest, stopsAtACancel) {
  TrajectoryClient torso("/torso_controller/follow_joint_trajectory", true);
  ASSERT_TRUE(torso.waitForServer(kPatience));
  torso.sendGoal(torsoGoal(0.38, 60));
  ASSERT_TRUE(eventually([&] { return world->joint("torso_lift_joint") > 0.001; }));
  torso.cancelGoal();
  ASSERT_TRUE(torso.waitForResult(kPatience));
  EXPECT_EQ(torso.getState(), State::PREEMPTED);
  EXPECT_LT(world->joint("torso_lift_joint"), 0.3);
}

TEST_F(FakeFetchNodeTest, looksAtAPlaceInAnyFrame) {
  actionlib::SimpleActionClient<control_msgs::PointHeadAction> head("/head_controller/point_head",
                                                                    true);
  ASSERT_TRUE(head.waitForServer(kPatience));
  control_msgs::PointHeadGoal goal;
  const Eigen::Vector3d p_map = world->T_map("base_link") * Eigen::Vector3d(1, 0.4, 0.7);
  goal.target.header.frame_id = "map";
  goal.target.point.x = p_map.x();
  goal.target.point.y = p_map.y();
  goal.target.point.z = p_map.z();
  EXPECT_EQ(head.sendGoalAndWait(goal, kPatience), State::SUCCEEDED);
  EXPECT_TRUE(eventually([&] {
    const Eigen::Isometry3d T = world->T_map("head_camera_link");
    return T.linear().col(0).cross((p_map - T.translation()).normalized()).norm() < 0.15;
  })) << "about: the camera sits beside the axes that it is reckoned by";
  goal.target.header.frame_id = "nowhere";
  EXPECT_EQ(head.sendGoalAndWait(goal, kPatience), State::ABORTED);
}

TEST_F(FakeFetchNodeTest, opensItsGripper) {
  actionlib::SimpleActionClient<control_msgs::GripperCommandAction> gripper(
      "/gripper_controller/gripper_action", true);
  ASSERT_TRUE(gripper.waitForServer(kPatience));
  control_msgs::GripperCommandGoal goal;
  goal.command.position = 0.06;
  EXPECT_EQ(gripper.sendGoalAndWait(goal, kPatience), State::SUCCEEDED);
  EXPECT_NEAR(gripper.getResult()->position, 0.06, 0.002);
  EXPECT_TRUE(gripper.getResult()->reached_goal);
}

TEST_F(FakeFetchNodeTest, doesNotStopItsGripperAtACancel) {
  actionlib::SimpleActionClient<control_msgs::GripperCommandAction> gripper(
      "/gripper_controller/gripper_action", true);
  ASSERT_TRUE(gripper.waitForServer(kPatience));
  control_msgs::GripperCommandGoal goal;
  goal.command.position = 0.1;
  gripper.sendGoal(goal);
  ASSERT_TRUE(eventually([] { return world->joint("l_gripper_finger_joint") > 0.002; }));
  gripper.cancelGoal();
  ASSERT_TRUE(gripper.waitForResult(kPatience));
  EXPECT_EQ(gripper.getState(), State::PREEMPTED);
  EXPECT_TRUE(eventually([] { return world->joint("l_gripper_finger_joint") > 0.0499; }));
}

TEST_F(FakeFetchNodeTest, tellsHowFarACommandSteppedAfterItsJointsWereMovedByHand) {
  TrajectoryClient torso("/torso_controller/follow_joint_trajectory", true);
  ASSERT_TRUE(torso.waitForServer(kPatience));
  ASSERT_EQ(torso.sendGoalAndWait(torsoGoal(0.1, 1), kPatience), State::SUCCEEDED);
  ros::Publisher hand = world->node->advertise<sensor_msgs::JointState>("/fake_fetch/hand", 1);
  sensor_msgs::JointState there;
  there.name = {"torso_lift_joint"};
  there.position = {0.3};
  ASSERT_TRUE(eventually([&] { return hand.getNumSubscribers() > 0; }));
  hand.publish(there);
  ASSERT_TRUE(eventually([] { return world->joint("torso_lift_joint") == 0.3; }));
  std::atomic<double> fastest{0};
  const auto commands = world->node->subscribe<sensor_msgs::JointState>(
      "/fake_fetch/commands", 100, [&](const auto& message) {
        for (const double velocity : message->velocity)
          if (velocity > fastest) fastest = velocity;
      });
  ASSERT_TRUE(eventually([&] { return commands.getNumPublishers() > 0; }));
  FollowJointTrajectoryGoal goal = torsoGoal(0.1, 0);
  goal.trajectory.points.push_back(goal.trajectory.points[0]);
  goal.trajectory.points[1].time_from_start = ros::Duration(3);
  torso.sendGoal(goal);
  EXPECT_TRUE(eventually([&] { return fastest > 0; }));
  EXPECT_NEAR(fastest, 0.2 / 0.01, 1e-6);
}

TEST_F(FakeFetchNodeTest, drivesAndStopsByItself) {
  const Eigen::Vector3d start = world->T_map("base_link").translation();
  const auto travel = [&] { return (world->T_map("base_link").translation() - start).norm(); };
  ASSERT_TRUE(driveUntil(0.4, [&] { return travel() > 0.1; }));
  EXPECT_GT(world->odometry().twist.twist.linear.x, 0);
  EXPECT_TRUE(eventually([&] { return world->odometry().twist.twist.linear.x == 0; }));
  ros::NodeHandle self("~");
  const auto truth = ros::topic::waitForMessage<geometry_msgs::PoseStamped>("true_pose", self);
  ASSERT_TRUE(truth);
  EXPECT_NEAR(truth->pose.position.x, world->T_map("base_link").translation().x(), 0.005)
      << "it looked where it stands up to 0.1 m ago";
}

TEST_F(FakeFetchNodeTest, isAsImperfectAsItIsToldToBe) {
  const ros::NodeHandle other("other_robot");
  other.setParam("latency", 0.08);
  other.setParam("localization_error", 0.03);
  other.setParam("localization_yaw_error", 0.0175);
  other.setParam("localization_distance", 0.2);
  other.setParam("localization_turn", 0.0);
  other.setParam("slowness", 1.3);
  const FakeFetchConfig config = readFakeFetchConfig(other);
  EXPECT_EQ(config.errors.latency, std::chrono::milliseconds(80));
  EXPECT_EQ(config.localization.position, 0.03);
  EXPECT_EQ(config.localization.yaw, 0.0175);
  EXPECT_EQ(config.localization.distance, 0.2);
  EXPECT_EQ(config.localization.turn, 0);
  EXPECT_EQ(config.slowness, 1.3);
  for (const char* name : {"latency", "localization_error", "slowness"}) {
    other.setParam(name, -1.0);
    EXPECT_THROW(readFakeFetchConfig(other), std::runtime_error) << name;
    other.setParam(name, 1.0);
  }
}

TEST_F(FakeFetchNodeTest, isBackAtItsStartAfterAReset) {
  const Eigen::Vector3d start(1, 0, 0);
  ASSERT_TRUE(driveUntil(
      -0.4, [&] { return (world->T_map("base_link").translation() - start).norm() > 0.05; }));
  // A command that arrives after the reset would drive it away again.
  ASSERT_TRUE(eventually([&] { return world->odometry().twist.twist.linear.x == 0; }));
  callReset();  // checks it
}

}  // namespace
}  // namespace afterglow::nodes::fake_fetch_ros_test
