// Robots' profiles: the one that is built in, and what is refused in a file.
#include "nodes/player/robot_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>

#include "nodes/player/play_options.hpp"
#include "replay/plan/robot_profile.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::robot_file_test {
namespace {

class RobotFileTest : public testing::Test {
 protected:
  std::string write(const std::string& text) {
    std::ofstream(folder_.path("robot.yaml")) << text;
    return folder_.path("robot.yaml");
  }
  /// The message without the folder.
  std::string fault(const std::string& text) {
    const std::string path = write(text);
    try {
      readRobotProfile(path);
      return "no fault";
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr(folder_.path("").size());
    }
  }

  test::TempFolder folder_;
};

TEST_F(RobotFileTest, theFetchIsBuiltIn) {
  const replay::RobotProfile fetch = findRobotProfile("fetch");
  EXPECT_EQ(fetch.name, "fetch");
  EXPECT_EQ(fetch.base.velocity_topic, "/cmd_vel");
  EXPECT_EQ(fetch.base.take_over_topics, std::vector<std::string>{"/teleop/cmd_vel"});
  EXPECT_EQ(fetch.base.output_topic, "/base_controller/command");
  EXPECT_EQ(fetch.base.base_frame, "base_link");
  EXPECT_EQ(fetch.base.footprint.size(), 8u);
  EXPECT_EQ(fetch.base.deceleration, 0.75);
  EXPECT_EQ(fetch.base.command_timeout_s, 0.25);
  EXPECT_EQ(fetch.scan_topic, "/base_scan");
  EXPECT_EQ(fetch.emergency_stop.topic, "/robot_state");
  EXPECT_EQ(fetch.emergency_stop.field, "runstopped");
  EXPECT_TRUE(fetch.emergency_stop.stops_when);
  EXPECT_EQ(fetch.base.linear_acceleration, 0.75);
  EXPECT_EQ(fetch.base.angular_acceleration, 3);
  EXPECT_EQ(fetch.joints.at("elbow_flex_joint").velocity, 1.521);
  EXPECT_EQ((*fetch.joints.at("shoulder_lift_joint").range)[0], -1.221);
  EXPECT_FALSE(fetch.joints.at("wrist_roll_joint").range) << "it turns without an end";
  EXPECT_EQ(fetch.gripper_joints.size(), 2u);
  EXPECT_EQ(fetch.gaze_frame, "head_tilt_link");
  EXPECT_FALSE(fetch.controllers_join) << "after a cancel they begin where that goal had led";
  EXPECT_TRUE(findRobotProfile("pr2").controllers_join);
}

std::string_view classOf(const replay::RobotProfile& robot, const char* topic, const char* type) {
  return name(replay::RobotTopics(robot).roleOf(topic, type).topic_class);
}

constexpr const char* kTwist = "geometry_msgs/Twist";
constexpr const char* kNumbers = "std_msgs/Float64MultiArray";
constexpr const char* kFollow = "control_msgs/FollowJointTrajectoryActionGoal";

TEST_F(RobotFileTest, everyRobotThatIsBuiltInIsKnownByTheNameOfItsFile) {
  for (const char* known : {"fetch", "pr2", "tiago", "turtlebot3", "ur"}) {
    const replay::RobotProfile robot = findRobotProfile(known);
    EXPECT_EQ(robot.name, known);
    EXPECT_FALSE(robot.controllers.empty()) << known;
    const replay::RobotTopics topics(robot);
    for (const std::string& controller : robot.controllers) {
      const bool is_velocity = controller == robot.base.velocity_topic;
      const replay::TopicRole role = is_velocity ? topics.roleOf(controller, kTwist)
                                                 : topics.roleOf(controller + "/goal", kFollow);
      EXPECT_EQ(name(role.topic_class), "body") << known << " " << controller;
    }
    for (const auto& [joint, limits] : robot.joints) {
      EXPECT_GT(limits.velocity.value_or(1), 0) << joint;
    }
  }
}

TEST_F(RobotFileTest, aTiagoIsEnteredAtItsMultiplexersLowestInput) {
  const replay::RobotProfile tiago = findRobotProfile("tiago");
  EXPECT_FALSE(tiago.base.is_holonomic);
  EXPECT_EQ(tiago.base.base_frame, "base_footprint");
  EXPECT_EQ(tiago.base.odometry_topic, "/mobile_base_controller/odom");
  EXPECT_EQ(tiago.base.command_timeout_s, 0.25);
  EXPECT_EQ(tiago.base.fastest, 1.0);
  EXPECT_EQ(tiago.base.fastest_turn, 2.09);
  EXPECT_EQ(tiago.emergency_stop.topic, "/power_status");
  EXPECT_TRUE(tiago.emergency_stop.stops_when);
  EXPECT_EQ(tiago.joints.at("arm_3_joint").velocity, 2.35);
  EXPECT_EQ(tiago.joints.at("torso_lift_joint").velocity, 0.07);
  EXPECT_EQ(classOf(tiago, "/nav_vel", kTwist), "body");
  for (const char* persons : {"/joy_vel", "/tab_vel", "/key_vel", "/servoing_cmd_vel"}) {
    EXPECT_EQ(classOf(tiago, persons, kTwist), "control input") << persons;
  }
  EXPECT_EQ(classOf(tiago, "/mobile_base_controller/cmd_vel", kTwist), "other");
  EXPECT_EQ(classOf(tiago, "/joy_priority", "std_msgs/Bool"), "control input");
  EXPECT_EQ(classOf(tiago, "/joy_priority_action/goal", "twist_mux_msgs/JoyPriorityActionGoal"),
            "control input");
  EXPECT_EQ(classOf(tiago, "/arm_forward_velocity_controller/command", kNumbers),
            "endless motion");
  EXPECT_EQ(classOf(tiago, "/head_controller/increment/goal",
                    "teleop_tools_msgs/IncrementActionGoal"),
            "other");
}

TEST_F(RobotFileTest, aPr2MayMoveWhileItsRunStopIsTrue) {
  const replay::RobotProfile pr2 = findRobotProfile("pr2");
  EXPECT_EQ(pr2.emergency_stop.topic, "/power_board/state");
  EXPECT_EQ(pr2.emergency_stop.field, "run_stop");
  EXPECT_FALSE(pr2.emergency_stop.stops_when) << "unlike a Fetch's";
  EXPECT_TRUE(pr2.base.is_holonomic);
  EXPECT_EQ(pr2.base.odom_frame, "odom_combined");
  EXPECT_EQ(pr2.base.command_timeout_s, 0.2);
  EXPECT_EQ(pr2.joints.size(), 14u);
  for (const auto& [joint, limits] : pr2.joints) {
    EXPECT_FALSE(limits.velocity) << "the description has it";
  }
  EXPECT_EQ(classOf(pr2, "/navigation/cmd_vel", kTwist), "body");
  EXPECT_EQ(classOf(pr2, "/teleop/cmd_vel", kTwist), "control input");
  EXPECT_EQ(classOf(pr2, "/base_controller/command", kTwist), "other");
  EXPECT_EQ(classOf(pr2, "/power_board/state", "pr2_msgs/PowerBoardState"), "other");
  EXPECT_EQ(classOf(pr2, "/laser_tilt_controller/set_traj_cmd", "pr2_msgs/LaserTrajCmd"),
            "endless motion");
  const char* const gripper = "/r_gripper_controller/gripper_action/goal";
  const char* const goal = "pr2_controllers_msgs/Pr2GripperCommandActionGoal";
  EXPECT_EQ(classOf(pr2, gripper, goal), "body");
  EXPECT_EQ(replay::knownStop(gripper, goal), replay::StopKind::EndsItself)
      << "a cancel drops what it holds";
}

TEST_F(RobotFileTest, aTurtleBot3HasNoMultiplexerAndNoEmergencyStop) {
  const replay::RobotProfile robot = findRobotProfile("turtlebot3");
  EXPECT_EQ(robot.base.velocity_topic, "/cmd_vel");
  EXPECT_TRUE(robot.base.output_topic.empty());
  EXPECT_EQ(robot.base.fastest, 0.26) << "a Waffle's";
  EXPECT_EQ(robot.base.fastest_turn, 2.84) << "a Burger's";
  EXPECT_EQ(robot.base.command_timeout_s, 0.5);
  EXPECT_TRUE(robot.emergency_stop.topic.empty());
  EXPECT_EQ(classOf(robot, "/cmd_vel", kTwist), "body");
  EXPECT_EQ(classOf(robot, "/motor_power", "std_msgs/Bool"), "control input");
  EXPECT_EQ(classOf(robot, "/reset", "std_msgs/Empty"), "other");
}

TEST_F(RobotFileTest, aUrStopsWhenItsProgramDoesAndTakesNoEndlessVelocities) {
  const replay::RobotProfile ur = findRobotProfile("ur");
  EXPECT_TRUE(ur.base.velocity_topic.empty());
  EXPECT_EQ(ur.emergency_stop.topic, "/ur_hardware_interface/robot_program_running");
  EXPECT_FALSE(ur.emergency_stop.stops_when);
  EXPECT_EQ(ur.joints.size(), 6u);
  EXPECT_EQ(classOf(ur, "/joint_group_vel_controller/command", kNumbers), "endless motion");
  EXPECT_EQ(classOf(ur, "/twist_controller/command", kTwist), "endless motion");
  EXPECT_EQ(classOf(ur, "/ur_hardware_interface/script_command", "std_msgs/String"),
            "endless motion");
  EXPECT_EQ(classOf(ur, "/forward_velocity_controller/commands", kNumbers), "endless motion")
      << "of ROS 2";
  EXPECT_EQ(classOf(ur, "/urscript_interface/script_command", "std_msgs/String"), "endless motion");
  EXPECT_EQ(classOf(ur, "/ur_hardware_interface/safety_mode", "ur_dashboard_msgs/SafetyMode"),
            "other");
}

TEST_F(RobotFileTest, aHolonomicBaseIsFollowedAsOne) {
  ReplayRequest request;
  for (const PlayOption& option : playOptions()) {
    if (option.name == "robot") giveOption(request, option, {"pr2"});
  }
  EXPECT_TRUE(request.body.base.is_holonomic);
  EXPECT_EQ(request.body.stops.emergency_stop.text(), "/power_board/state:!run_stop");
}

TEST_F(RobotFileTest, ofANameOnlyNothingIsKnown) {
  const replay::RobotProfile robot = readRobotProfile(write("name: mine\n"));
  EXPECT_EQ(robot.name, "mine");
  EXPECT_TRUE(robot.topics.empty());
  EXPECT_TRUE(robot.base.base_frame.empty());
  EXPECT_TRUE(robot.base.footprint.empty());
  EXPECT_TRUE(robot.emergency_stop.topic.empty());
}

TEST_F(RobotFileTest, whatIsNotUnderstoodIsRefusedWithItsLineAndTheNearestKey) {
  EXPECT_EQ(fault("base: {}\n"), "robot.yaml:1: no 'name' in the robot");
  EXPECT_EQ(fault("name: a\nscan_topik: /scan\n"),
            "robot.yaml:2: unknown key 'scan_topik' in the robot; did you mean 'scan_topic'?");
  EXPECT_EQ(fault("name: a\nscan_topic: scan\n"),
            "robot.yaml:2: 'scan' is no topic: it begins with no slash");
  EXPECT_EQ(fault("name: a\nbase:\n  footprint: [[0, 1], [1, 0]]\n"),
            "robot.yaml:3: 'footprint' should be a list of at least 3 corners, [x, y] in m");
  EXPECT_EQ(fault("name: a\njoints: {elbow: {sped: 1}}\n"),
            "robot.yaml:2: unknown key 'sped' in joint elbow; did you mean 'speed'?");
  EXPECT_EQ(fault("name: a\ncontrollers: [arm]\n"), "robot.yaml:2: 'arm' is no topic: it begins with no slash");
  const std::string stop = fault("name: a\nemergency_stop: {topic: /stop, stops_when: maybe}\n");
  EXPECT_EQ(stop.find("robot.yaml:2: unknown stops_when 'maybe' in emergency_stop"), 0u) << stop;
}

TEST_F(RobotFileTest, aRobotAmongSeveralHasItsTopicsInItsNamespaceAndItsFramesUnderItsPrefix) {
  const replay::RobotProfile fetch = withNames(findRobotProfile("fetch"), {"/fetch7", "f7"});
  EXPECT_EQ(fetch.base.velocity_topic, "/fetch7/cmd_vel");
  EXPECT_EQ(fetch.base.take_over_topics, std::vector<std::string>{"/fetch7/teleop/cmd_vel"});
  EXPECT_EQ(fetch.base.output_topic, "/fetch7/base_controller/command");
  EXPECT_EQ(fetch.base.odometry_topic, "/fetch7/odom");
  EXPECT_EQ(fetch.scan_topic, "/fetch7/base_scan");
  EXPECT_EQ(fetch.emergency_stop.topic, "/fetch7/robot_state");
  EXPECT_EQ(fetch.controllers.front().find("/fetch7/"), 0u) << fetch.controllers.front();
  EXPECT_EQ(fetch.base.base_frame, "f7/base_link");
  EXPECT_EQ(fetch.base.map_frame, "map") << "the world's";
  EXPECT_EQ(fetch.gaze_frame.find("f7/"), 0u) << fetch.gaze_frame;
  EXPECT_EQ(withNames(findRobotProfile("fetch"), {}).scan_topic, "/base_scan");
  EXPECT_EQ(withNames({}, {"/fetch7", "f7"}).scan_topic, "") << "what is not known stays so";
}

TEST_F(RobotFileTest, aRobotThatIsNotKnownIsRefusedWithTheNearestName) {
  try {
    findRobotProfile("fetsh");
    FAIL() << "it is known";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()),
              "no robot 'fetsh' is known; did you mean 'fetch'? (a file has a slash or ends in "
              ".yaml)");
  }
}

TEST_F(RobotFileTest, optionsSayMoreThanTheProfileWhateverTheirOrder) {
  const std::string path = write("name: mine\nbase: {frames: {base: base_footprint, odom: o}}\n");
  ReplayRequest request;
  for (const PlayOption& option : playOptions()) {  // as command line and parameters are set
    if (option.name == "robot") giveOption(request, option, {path});
    if (option.name == "base_frame") giveOption(request, option, {"odom=odom_combined"});
  }
  EXPECT_EQ(request.body.robot.name, "mine");
  EXPECT_EQ(request.body.robot.name, "mine");
  EXPECT_EQ(request.body.base.frames.base, "base_footprint");
  EXPECT_EQ(request.body.base.frames.odometry, "odom_combined");
  EXPECT_EQ(request.body.base.frames.map, "map");
}

}  // namespace
}  // namespace afterglow::nodes::robot_file_test
