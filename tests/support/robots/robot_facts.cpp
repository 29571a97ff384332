#include "tests/support/robots/robot_facts.hpp"

#include <fmt/format.h>

#include <map>

namespace afterglow::test {
namespace {

using Kind = nodes::Joint::Kind;
using Of = ControllerFacts::Kind;

constexpr double kTurn = 2 * replay::kPi;

RobotFacts tiago() {
  RobotFacts robot;
  robot.name = "tiago";
  robot.joints = {{"torso_lift_joint", 0, 0.35, 0.07, Kind::Prismatic},
                  {"head_1_joint", -1.31, 1.31, 3},
                  {"head_2_joint", -1.05, 0.79, 3},
                  {"gripper_left_finger_joint", 0, 0.045, 0.05, Kind::Prismatic},
                  {"gripper_right_finger_joint", 0, 0.045, 0.05, Kind::Prismatic}};
  ControllerFacts arm{"arm_controller", {}, Of::RosControl, 0, 0, 0.02, 0.6};
  const std::vector<double> speeds = {1.95, 1.95, 2.35, 2.35, 1.95, 0.75, 1.76};
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    arm.joints.push_back(fmt::format("arm_{}_joint", i + 1));
    robot.joints.push_back({arm.joints.back(), -3, 3, speeds[i]});
  }
  robot.controllers = {
      arm,
      {"torso_controller", {"torso_lift_joint"}, Of::RosControl, 0, 0, 0.02, 0.6},
      {"head_controller", {"head_1_joint", "head_2_joint"}, Of::RosControl, 0, 0, 0.5, 2},
      {"gripper_controller",
       {"gripper_left_finger_joint", "gripper_right_finger_joint"},
       Of::RosControl, 0, 0, 0.02, 0.6}};
  BaseFacts base{"/mobile_base_controller/cmd_vel", "/mobile_base_controller/odom", "odom",
                 "base_footprint",                  {1, 2.09, 0.25},               {}};
  base.manners.fastest = 1;
  base.manners.fastest_back = 0.2;
  base.manners.fastest_turn = 2.09;
  base.scan = {"/scan", "base_laser_link", 1.66};
  base.echo_topic = "/mobile_base_controller/cmd_vel_out";
  robot.base = base;
  robot.mux = MuxFacts{{{"/joy_vel", 100},
                        {"/tab_vel", 100},
                        {"/marker_vel", 99},
                        {"/phone_vel", 98},
                        {"/rviz_joy_vel", 95},
                        {"/key_vel", 90},
                        {"/servoing_cmd_vel", 20},
                        {"/nav_vel", 10}},
                       {{"/stop_closing_loop", 200},
                        {"/pause_navigation", 100},
                        {"/joy_priority", 100},
                        {"/emergency_brake", 100}},
                       base.command_topic};
  robot.stop = StopFacts{"/power_status", "afterglow/SimulatedPowerStatus",
                         "bool is_emergency\n", "is_emergency", true, 0.1};
  return robot;
}

RobotFacts pr2() {
  RobotFacts robot;
  robot.name = "pr2";
  robot.joints = {{"r_shoulder_pan_joint", -2.2, 0.7, 2.088},
                  {"r_shoulder_lift_joint", -0.5, 1.4, 2.082},
                  {"r_upper_arm_roll_joint", -3.9, 0.8, 3.27},
                  {"r_elbow_flex_joint", -2.3, 0, 3.3},
                  {"r_forearm_roll_joint", 0, 0, 3.6, Kind::Continuous},
                  {"r_wrist_flex_joint", -2.1, 0, 3.078},
                  {"r_wrist_roll_joint", 0, 0, 3.6, Kind::Continuous}};
  ControllerFacts arm{"r_arm_controller", {}, Of::Pr2, 0, 0, 0.02, 0.6};
  for (const JointFacts& joint : robot.joints) arm.joints.push_back(joint.name);
  robot.controllers = {arm,
                       {"torso_controller", {"torso_lift_joint"}, Of::Pr2, 0, 0, 0.02, 0.6}};
  robot.joints.push_back({"torso_lift_joint", 0, 0.33, 0.013, Kind::Prismatic});
  robot.joints.push_back({"r_gripper_joint", 0, 0.09, 0.2, Kind::Prismatic});
  robot.gripper = GripperFacts{"/r_gripper_controller/gripper_action", "r_gripper_joint", 0.086,
                               0.05};
  BaseFacts base{"/base_controller/command", "/base_odometry/odom", "odom_combined",
                 "base_footprint",           kPr2Manners,           {}};
  base.manners.fastest = base.manners.fastest_back = 1;
  base.manners.fastest_turn = 2;
  base.scan = {"/base_scan", "base_laser_link", 2.27};
  robot.base = base;
  robot.mux = MuxFacts{{{"/navigation/cmd_vel", 0}, {"/teleop/cmd_vel", 0}}, {}, ""};
  robot.stop = StopFacts{"/power_board/state", "afterglow/SimulatedPowerBoardState",
                         "string name\nbool run_stop\nbool wireless_stop\n", "run_stop", false,
                         0.1};
  return robot;
}

RobotFacts turtlebot3() {
  RobotFacts robot;
  robot.name = "turtlebot3";
  BaseFacts base{"/cmd_vel", "/odom", "odom", "base_footprint", {1e9, 1e9, 0.5, true}, {}};
  base.manners.fastest = base.manners.fastest_back = 0.22;
  base.manners.fastest_turn = 2.84;
  base.scan = {"/scan", "base_scan", replay::kPi};
  robot.base = base;
  return robot;
}

RobotFacts ur() {
  RobotFacts robot;
  robot.name = "ur";
  ControllerFacts arm{"scaled_pos_joint_traj_controller", {}, Of::RosControl, 0.5, 0.2, 0.1, 0.6};
  for (const char* joint : {"shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2",
                            "wrist_3"}) {
    arm.joints.push_back(fmt::format("{}_joint", joint));
    const double most = joint == std::string("elbow") ? kTurn / 2 : kTurn;
    robot.joints.push_back({arm.joints.back(), -most, most, replay::kPi});
  }
  robot.controllers = {arm};
  robot.stop = StopFacts{"/ur_hardware_interface/robot_program_running", "std_msgs/Bool",
                         "bool data\n", "data", false, 0, true};
  robot.has_speed_scale = true;
  return robot;
}

std::string urdfJoint(const JointFacts& joint, const std::string& parent) {
  const char* type = joint.kind == Kind::Continuous  ? "continuous"
                     : joint.kind == Kind::Prismatic ? "prismatic"
                                                     : "revolute";
  return fmt::format(
      "<link name='{0}_link'/><joint name='{0}' type='{1}'><parent link='{2}'/>"
      "<child link='{0}_link'/><axis xyz='0 0 1'/>"
      "<limit lower='{3}' upper='{4}' velocity='{5}' effort='100'/></joint>\n",
      joint.name, type, parent, joint.lower, joint.upper, joint.speed);
}

}  // namespace

std::string RobotFacts::description() const {
  const std::string root = base ? base->base_frame : "base_link";
  std::string urdf = fmt::format("<robot name='{}'><link name='{}'/>\n", name, root);
  for (const JointFacts& joint : joints) urdf += urdfJoint(joint, root);
  return urdf + "</robot>\n";
}

const RobotFacts& factsOf(const std::string& name) {
  static const std::map<std::string, RobotFacts> all = {
      {"tiago", tiago()}, {"pr2", pr2()}, {"turtlebot3", turtlebot3()}, {"ur", ur()}};
  return all.at(name);
}

}  // namespace afterglow::test
