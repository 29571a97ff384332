#include "replay/plan/recorded_drivers.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/recorded_robot.hpp"

namespace afterglow::replay::nested_goals_test {
namespace {

const std::string kTwist = "geometry_msgs/Twist", kJoy = "sensor_msgs/Joy";
const std::string kFollow = "control_msgs/FollowJointTrajectoryActionGoal";
const std::string kMoveBase = "move_base_msgs/MoveBaseActionGoal";

using test::Around;
using Robot = test::RecordedRobot;
using test::whyNot;
using Texts = std::vector<std::string>;

TEST(NestedGoals, areRecognizedByWhoSentTheLowerOne) {
  Robot robot;
  robot.add("/tidy/goal", "tidy_msgs/TidyActionGoal", {{"/tree"}, {"/tidy_server"}});
  robot.add("/arm_controller/follow_joint_trajectory/goal", kFollow,
            {{"/tidy_server"}, {"/controllers"}});
  PlanOptions options;
  EXPECT_EQ(robot.plan().playedTopics(), Texts{"/arm_controller/follow_joint_trajectory/goal"});
  EXPECT_EQ(whyNot(robot.plan(), "/tidy/goal"),
            "the robot sent /arm_controller/follow_joint_trajectory/goal for it, which is played "
            "instead");
  options.also = {"/tidy/goal"};
  EXPECT_EQ(robot.plan(options).playedTopics(), Texts{"/tidy/goal"});
  EXPECT_EQ(whyNot(robot.plan(options), "/arm_controller/follow_joint_trajectory/goal"),
            "the robot sent it for /tidy/goal, which is played");
  options.also.push_back("/arm_controller/follow_joint_trajectory/goal");
  EXPECT_EQ(robot.plan(options).refusal(),
            "/tidy/goal (tidy_msgs/TidyActionGoal) is not played: the robot sends "
            "/arm_controller/follow_joint_trajectory/goal for it, which is played, too: one of "
            "the two; --exclude it to play the rest");
}

TEST(NestedGoals, areNotMistakenForThoseOfAnother) {
  Robot robot;
  robot.add("/move_base/goal", kMoveBase, {{"/tree"}, {"/move_base"}});
  robot.add("/cmd_vel", kTwist, {{"/docking"}, {"/base"}});
  PlanOptions options;
  options.also = {"/move_base/goal"};
  EXPECT_EQ(robot.plan(options).playedTopics(), (Texts{"/cmd_vel", "/move_base/goal"}));
}

TEST(NestedGoals, areFoundThroughASmoother) {
  Robot robot;
  robot.add("/move_base/goal", kMoveBase, {{"/tree"}, {"/move_base"}});
  robot.add("/cmd_vel_mux/input/navi", kTwist, {{"/smoother"}, {"/cmd_vel_mux"}});
  robot.note("/smoother/raw_cmd_vel", kTwist, {{"/move_base"}, {"/smoother"}});
  PlanOptions options;
  options.also = {"/move_base/goal"};
  const PlayPlan plan = robot.plan(options);
  EXPECT_EQ(plan.playedTopics(), Texts{"/move_base/goal"}) << "not twice";
}

TEST(NestedGoals, areKnownByNameWhereNothingWasNoted) {
  Robot robot;
  robot.add("/execute_trajectory/goal", "moveit_msgs/ExecuteTrajectoryActionGoal");
  robot.add("/arm_controller/follow_joint_trajectory/goal", kFollow);
  robot.add("/parallel_gripper_controller/follow_joint_trajectory/goal", kFollow);
  robot.add("/parallel_gripper_controller/follow_joint_trajectory/cancel",
            "actionlib_msgs/GoalID");
  robot.add("/gripper_controller/follow_joint_trajectory/goal", kFollow);
  robot.add("/head_traj_controller/point_head_action/goal",
            "pr2_controllers_msgs/PointHeadActionGoal");
  robot.add("/head_traj_controller/command", "trajectory_msgs/JointTrajectory");
  robot.add("/robot2/move_base/goal", kMoveBase);
  robot.add("/cmd_vel", kTwist);
  const PlayPlan plan = robot.plan();
  EXPECT_EQ(plan.playedTopics(),
            (Texts{"/arm_controller/follow_joint_trajectory/goal", "/cmd_vel",
                   "/gripper_controller/follow_joint_trajectory/goal",
                   "/head_traj_controller/point_head_action/goal"}));
  EXPECT_EQ(whyNot(plan, "/robot2/move_base/goal"), "an action that goes its own way today")
      << "another robot's";
}

TEST(NestedGoals, ofAProgramThatIsClientAndServerTellNothing) {
  Robot robot;
  robot.add("/arm_controller/follow_joint_trajectory/goal", kFollow, {{"/all"}, {"/all"}});
  robot.add("/l_arm_controller/follow_joint_trajectory/goal", kFollow, {{"/all"}, {"/all"}});
  EXPECT_EQ(robot.plan().playedTopics().size(), 2u);
}

// ------------------------------------------------- whole recordings, as other robots make them

std::string_view classOf(const PlayPlan& plan, const std::string& topic) {
  for (const PlannedTopic& one : plan.topics) {
    if (one.channel.topic == topic) return name(one.topic_class);
  }
  return "not planned";
}

/// What nodes of every robot send besides.
void addStates(Robot& robot) {
  for (const auto& [topic, type] : std::map<std::string, std::string>{
           {"/tf", "tf2_msgs/TFMessage"},
           {"/joint_states", "sensor_msgs/JointState"},
           {"/odom", "nav_msgs/Odometry"},
           {"/map", "nav_msgs/OccupancyGrid"},
           {"/rosout", "rosgraph_msgs/Log"},
           {"/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped"},
           {"/move_base/result", "move_base_msgs/MoveBaseActionResult"},
           {"/diagnostics", "diagnostic_msgs/DiagnosticArray"}}) {
    robot.add(topic, type);
  }
}

TEST(RobotRecording, ofATiagoPlaysItsControllersGoalsAndTheLowestInputOfItsMultiplexer) {
  Robot robot;
  addStates(robot);
  robot.add("/move_base/goal", kMoveBase, {{"/tree"}, {"/move_base"}});
  robot.add("/nav_vel", kTwist, {{"/move_base"}, {"/twist_mux"}});
  robot.add("/joy_vel", kTwist, {{"/joystick"}, {"/twist_mux"}});
  robot.add("/mobile_base_controller/cmd_vel", kTwist, {{"/twist_mux"}, {"/controllers"}});
  robot.add("/joy_priority", "std_msgs/Bool", {{"/joystick"}, {"/twist_mux"}});
  robot.add("/play_motion/goal", "play_motion_msgs/PlayMotionActionGoal",
            {{"/tree"}, {"/play_motion"}});
  robot.add("/arm_controller/follow_joint_trajectory/goal", kFollow,
            {{"/play_motion"}, {"/controllers"}});
  robot.add("/head_controller/point_head_action/goal", "control_msgs/PointHeadActionGoal",
            {{"/tree"}, {"/head_action"}});
  robot.add("/head_controller/command", "trajectory_msgs/JointTrajectory",
            {{"/head_action"}, {"/controllers"}});
  robot.add("/parallel_gripper_controller/follow_joint_trajectory/goal", kFollow,
            {{"/tree"}, {"/parallel_gripper"}});
  robot.add("/gripper_controller/follow_joint_trajectory/goal", kFollow,
            {{"/parallel_gripper"}, {"/controllers"}});
  robot.add("/torso_controller/safe_command", "trajectory_msgs/JointTrajectory",
            {{"/joystick"}, {"/safe"}});
  robot.add("/scan_raw", "sensor_msgs/LaserScan", {{"/laser"}, {"/amcl"}});
  const PlayPlan plan = robot.plan();
  EXPECT_EQ(plan.playedTopics(), (Texts{"/arm_controller/follow_joint_trajectory/goal",
                                        "/gripper_controller/follow_joint_trajectory/goal",
                                        "/head_controller/point_head_action/goal", "/nav_vel"}));
  EXPECT_EQ(plan.refusal(), "");
  EXPECT_EQ(classOf(plan, "/joy_vel"), "control input");
  EXPECT_EQ(classOf(plan, "/joy_priority"), "control input");
  EXPECT_EQ(classOf(plan, "/mobile_base_controller/cmd_vel"), "other") << "behind the multiplexer";
  EXPECT_EQ(classOf(plan, "/torso_controller/safe_command"), "endless motion");
}

TEST(RobotRecording, ofAPr2PlaysActionsAndNotWhatTheySend) {
  Robot robot;  // an import: nobody noted who sent what
  addStates(robot);
  robot.add("/move_base/goal", kMoveBase);
  robot.add("/navigation/cmd_vel", kTwist);
  robot.add("/teleop/cmd_vel", kTwist);
  robot.add("/base_controller/command", kTwist);
  robot.add("/joy", kJoy);
  robot.add("/r_arm_controller/joint_trajectory_action/goal",
            "pr2_controllers_msgs/JointTrajectoryActionGoal");
  robot.add("/r_arm_controller/command", "trajectory_msgs/JointTrajectory");
  robot.add("/r_gripper_controller/gripper_action/goal",
            "pr2_controllers_msgs/Pr2GripperCommandActionGoal");
  robot.add("/r_gripper_controller/command", "pr2_controllers_msgs/Pr2GripperCommand");
  robot.add("/head_traj_controller/point_head_action/goal",
            "pr2_controllers_msgs/PointHeadActionGoal");
  robot.add("/torso_controller/position_joint_action/goal",
            "pr2_controllers_msgs/SingleJointPositionActionGoal");
  robot.add("/laser_tilt_controller/set_traj_cmd", "pr2_msgs/LaserTrajCmd");
  robot.add("/power_board/state", "pr2_msgs/PowerBoardState");
  robot.add("/tilt_scan", "sensor_msgs/LaserScan");
  const PlayPlan plan = robot.plan();
  EXPECT_EQ(plan.playedTopics(), (Texts{"/head_traj_controller/point_head_action/goal",
                                        "/navigation/cmd_vel",
                                        "/r_arm_controller/joint_trajectory_action/goal",
                                        "/r_gripper_controller/gripper_action/goal",
                                        "/torso_controller/position_joint_action/goal"}));
  EXPECT_EQ(plan.refusal(), "");
  EXPECT_EQ(classOf(plan, "/teleop/cmd_vel"), "control input");
  EXPECT_EQ(classOf(plan, "/base_controller/command"), "other");
  EXPECT_EQ(classOf(plan, "/laser_tilt_controller/set_traj_cmd"), "endless motion");
  EXPECT_EQ(whyNot(plan, "/move_base/goal"),
            "the robot sent /navigation/cmd_vel for it, which is played instead");
}

TEST(RobotRecording, ofATurtleBotPlaysWhatNavigationDroveAndNoPerson) {
  Robot second;
  addStates(second);
  second.add("/cmd_vel_mux/input/navi", kTwist, {{"/smoother"}, {"/cmd_vel_mux"}});
  second.add("/cmd_vel_mux/input/teleop", kTwist, {{"/turtlebot_teleop"}, {"/cmd_vel_mux"}});
  second.add("/cmd_vel_mux/input/safety_controller", kTwist, {{"/safety"}, {"/cmd_vel_mux"}});
  second.add("/mobile_base/commands/velocity", kTwist, {{"/cmd_vel_mux"}, {"/mobile_base"}});
  second.add("/mobile_base/commands/motor_power", "kobuki_msgs/MotorPower");
  second.add("/mobile_base/commands/reset_odometry", "std_msgs/Empty");
  second.add("/mobile_base/events/bumper", "kobuki_msgs/BumperEvent");
  const PlayPlan plan = second.plan();
  EXPECT_EQ(plan.playedTopics(), Texts{"/cmd_vel_mux/input/navi"});
  EXPECT_EQ(plan.refusal(), "");
  for (const char* input : {"/cmd_vel_mux/input/teleop", "/cmd_vel_mux/input/safety_controller",
                            "/mobile_base/commands/motor_power"}) {
    EXPECT_EQ(classOf(plan, input), "control input") << input;
  }
  EXPECT_EQ(classOf(plan, "/mobile_base/commands/velocity"), "other");

  Robot third;
  addStates(third);
  third.add("/cmd_vel", kTwist, {{"/move_base"}, {"/turtlebot3_core"}});
  third.add("/cmd_vel_rc100", kTwist, {{"/turtlebot3_core"}, {"/rosbag"}});
  third.add("/motor_power", "std_msgs/Bool");
  third.add("/reset", "std_msgs/Empty");
  EXPECT_EQ(third.plan().playedTopics(), Texts{"/cmd_vel"});
  EXPECT_EQ(classOf(third.plan(), "/motor_power"), "control input");
  third.note("/cmd_vel", kTwist, {{"/turtlebot3_teleop_keyboard"}, {"/turtlebot3_core"}});
  EXPECT_EQ(third.plan().playedTopics(), Texts()) << "a person drove";
}

TEST(RobotRecording, ofAUrPlaysTheControllersGoalAndRefusesProgramsWhoeverNamesThem) {
  Robot robot;
  addStates(robot);
  const std::string goal = "/scaled_pos_joint_traj_controller/follow_joint_trajectory/goal";
  const std::string script = "/ur_hardware_interface/script_command";
  robot.add("/execute_trajectory/goal", "moveit_msgs/ExecuteTrajectoryActionGoal",
            {{"/tree"}, {"/move_group"}});
  robot.add(goal, kFollow, {{"/move_group"}, {"/ur_hardware_interface"}});
  robot.add(script, "std_msgs/String", {{"/tree"}, {"/ur_hardware_interface"}});
  robot.add("/twist_controller/command", kTwist, {{"/servo"}, {"/ur_hardware_interface"}});
  robot.add("/trajectory_execution_event", "std_msgs/String", {{"/rviz"}, {"/move_group"}});
  robot.add("/ur_hardware_interface/safety_mode", "ur_dashboard_msgs/SafetyMode");
  const PlayPlan plan = robot.plan();
  EXPECT_EQ(plan.playedTopics(), Texts{goal});
  EXPECT_EQ(classOf(plan, script), "endless motion");
  EXPECT_EQ(classOf(plan, "/twist_controller/command"), "endless motion");
  EXPECT_EQ(classOf(plan, "/trajectory_execution_event"), "control input");
  PlanOptions options;
  options.also = {script};
  const std::string refusal = robot.plan(options).refusal();
  EXPECT_NE(refusal.find(script), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("it runs any program"), std::string::npos) << refusal;
}

// ------------------------------------------------------------------------------------ who drove

TEST(RecordedDriver, isAPersonWhereOnlyAJoysticksNodeSent) {
  Robot robot;
  robot.add("/cmd_vel", kTwist, {{"/pad"}, {"/base"}});
  EXPECT_EQ(robot.plan().playedTopics(), Texts{"/cmd_vel"});
  robot.note("/joy", kJoy, {{"/joy_node"}, {"/pad"}});
  EXPECT_EQ(robot.plan().playedTopics(), Texts());
  EXPECT_EQ(whyNot(robot.plan(), "/cmd_vel"), "a person's velocities: /pad alone sent them");
  PlanOptions options;
  options.also = {"/cmd_vel"};
  EXPECT_EQ(robot.plan(options).playedTopics(), Texts{"/cmd_vel"}) << "whoever names it has it";
  robot.note("/cmd_vel", kTwist, {{"/pad", "/move_base"}, {"/base"}});
  EXPECT_EQ(robot.plan().playedTopics(), Texts{"/cmd_vel"}) << "a program drove, too";
  robot.note("/cmd_vel", kTwist, {{"/teleop_twist_keyboard"}, {"/base"}});
  EXPECT_EQ(robot.plan().playedTopics(), Texts()) << "by its name";
  Robot imported;
  imported.add("/turtle1/cmd_vel", kTwist, {{"/teleop_turtle"}, {}});
  EXPECT_EQ(imported.plan().playedTopics(), Texts{"/turtle1/cmd_vel"})
      << "a bag tells of the senders alone, and plays as it always did";
}

TEST(RecordedDriver, isAMultiplexerThatHearsOtherVelocities) {
  Robot robot;
  robot.add("/nav", kTwist, {{"/planner"}, {"/chooser"}});
  robot.add("/drive", kTwist, {{"/chooser"}, {"/base"}});
  EXPECT_EQ(robot.plan().playedTopics(), Texts{"/nav"}) << "people override it behind there";
  EXPECT_EQ(whyNot(robot.plan(), "/drive"),
            "the base behind its multiplexer, /chooser: nobody could override it");
  robot.note("/drive", kTwist, {{"/chooser"}, {"/base", "/chooser"}});
  EXPECT_EQ(robot.plan().playedTopics().size(), 2u) << "a player that watches its own topic";
}

TEST(RecordedDriver, isNoMultiplexerThatHearsWhatTheBaseMakesOfIt) {
  Robot robot;
  robot.add("/cmd_vel", kTwist, {{"/tree"}, {"/mixer"}});
  robot.add("/teleop/cmd_vel", kTwist, {{"/tree"}, {"/mixer", "/tree"}});
  robot.add("/base_controller/command", kTwist, {{"/mixer"}, {"/mixer", "/tree"}});
  EXPECT_EQ(robot.plan().playedTopics(), Texts{"/cmd_vel"}) << "/tree sends, and watches";
}

TEST(RecordedDriver, isAPersonsOfEveryTypeOfVelocity) {
  for (const char* type :
       {"geometry_msgs/Twist", "geometry_msgs/TwistStamped", "ackermann_msgs/AckermannDrive",
        "ackermann_msgs/AckermannDriveStamped"}) {
    Robot robot;
    robot.add("/drive", type, {{"/teleop"}, {"/base"}});
    EXPECT_EQ(classOf(robot.plan(), "/drive"), "control input") << type;
  }
}

TEST(RecordedDriver, isToldWhereNobodyHeardIt) {
  Robot robot;
  robot.add("/cmd_vel", kTwist, {{"/planner"}, {}});
  robot.note("/odom", "nav_msgs/Odometry", {{"/base"}, {"/planner"}});
  const PlayPlan plan = robot.plan();
  ASSERT_EQ(plan.topics.size(), 1u);
  EXPECT_EQ(plan.topics[0].why_class, "a zero stops it; nobody heard it when it was recorded");
  EXPECT_TRUE(plan.topics[0].isPlayed());
  robot.note("/cmd_vel", kTwist, {{"/planner"}, {"/base"}});
  EXPECT_EQ(robot.plan().topics[0].why_class, "a zero stops it");
}

TEST(RecordedNodes, areKeptInTheSnapshotAndMissingInOldOnes) {
  Snapshot snapshot;
  snapshot.nodes["/cmd_vel"] = {kTwist, {"/a", "/b"}, {"/base"}};
  Behavior behavior;
  behavior.snapshot = snapshot.toJson();
  RecordedNodes nodes = recordedNodes(behavior);
  EXPECT_EQ(nodes.at("/cmd_vel").type, kTwist);
  EXPECT_EQ(nodes.at("/cmd_vel").publishers, (std::set<std::string>{"/a", "/b"}));
  addNodes(nodes, {{"/cmd_vel", {"", {"/c"}, {}}}, {"/joy", {kJoy, {"/d"}, {}}}});
  EXPECT_EQ(nodes.at("/cmd_vel").publishers.size(), 3u);
  EXPECT_EQ(nodes.at("/joy").type, kJoy);
  for (const char* old :
       {"{}", "", R"({"nodes": 1})", R"({"nodes": {"/a": 2, "/b": {"type": 3}}})"}) {
    behavior.snapshot = old;
    EXPECT_LE(recordedNodes(behavior).size(), 1u) << old;
  }
}

}  // namespace
}  // namespace afterglow::replay::nested_goals_test
