#include "replay/plan/topic_role.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace afterglow::replay {
namespace {

template <std::size_t n>
bool isOneOf(std::string_view text, const std::array<std::string_view, n>& known) {
  return std::find(known.begin(), known.end(), text) != known.end();
}

bool startsWith(std::string_view text, std::string_view start) {
  return text.substr(0, start.size()) == start;
}

bool endsWith(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

std::string_view lastName(std::string_view topic) { return topic.substr(topic.rfind('/') + 1); }

/// `*` stands for any characters, slashes too.
bool matches(std::string_view text, std::string_view pattern) {
  if (pattern.empty()) return text.empty();
  if (pattern[0] != '*') {
    return !text.empty() && text[0] == pattern[0] && matches(text.substr(1), pattern.substr(1));
  }
  for (std::size_t skipped = 0; skipped <= text.size(); ++skipped) {
    if (matches(text.substr(skipped), pattern.substr(1))) return true;
  }
  return false;
}

constexpr std::string_view kTwist = "geometry_msgs/Twist*";
constexpr std::string_view kAckermann = "ackermann_msgs/AckermannDrive*";
constexpr std::string_view kPose = "geometry_msgs/Pose*";

using RoleRule = TopicRow;
using Rules = std::vector<RoleRule>;

/// Inputs of a person, a safety device or the robot's own switches.
const Rules& controlRules() {
  constexpr auto kControl = TopicClass::Control;
  static const Rules rules{
      {{}, {"sensor_msgs/Joy*"}, {kControl, "a joystick: base and arm are driven by it"}},
      {{"joy", "joy_orig"}, {}, {kControl, "a joystick: base and arm are driven by it"}},
      {{"*runstop*", "*estop*", "*e_stop*", "*emergency*", "*motors_halted"},
       {},
       {kControl, "an emergency stop: it would stop the robot, or let it go"}},
      {{"*stop*"}, {"std_msgs/*"}, {kControl, "by its name a stop, or what lets the robot go"}},
      {{"*error_recovery/*", "*clear_faults", "*reset_faults", "*unlock_protective_stop"},
       {},
       {kControl, "it lets a stopped robot move again"}},
      {{"joy_priority", "joy_priority_action/*", "joy_turbo_*", "pause_navigation",
        "stop_closing_loop"},
       {},
       {kControl, "a lock of the robot's inputs"}},
      {{"motor_power", "*breaker*", "*set_super_enable", "*motors_enable*", "*enable_motors",
        "*enable_drives"},
       {},
       {kControl, "it switches motors on or off"}},
      {{"initialpose"}, {}, {kControl, "it moves the robot's estimate of where it stands"}},
      {{"clock"}, {}, {kControl, "time is not replayed: every running node would go by it"}},
      {{}, {"rosgraph_msgs/Clock"}, {kControl, "time is not replayed"}},
      {{"clicked_point", "trajectory_execution_event"}, {}, {kControl, "somebody's command"}},
      {{},
       {"visualization_msgs/InteractiveMarkerFeedback"},
       {kControl, "a person's hand on a marker: marker servers drive by it"}},
      {{"*teleop*", "*joy*", "*keyboard*", "key_vel", "tab_vel", "phone_vel", "marker_vel",
        "*twist_marker*", "*rviz*", "*manual*", "input/switch"},
       {kTwist, kAckermann},
       {kControl, "a person's velocities, which override others"}},
      {{"input/safety_controller"}, {}, {kControl, "the safety controller's velocities"}},
      {{"*safety*"}, {kTwist, kAckermann}, {kControl, "the safety controller's velocities"}}};
  return rules;
}

/// Topics of a type that moves, speaks or is drawn, but that do something else.
const Rules& exceptionRules() {
  constexpr auto kOther = TopicClass::Other, kEndless = TopicClass::Endless;
  static const Rules rules{
      {{"cmd_vel_mux/active", "cmd_vel_mux/selected", "*cmd_vel_out", "cmd_vel_rc100"},
       {},
       {kOther, "an output of the base"}},
      {{"*twist_controller/command", "*cartesian_twist/*", "*delta_twist_cmds"},
       {},
       {kEndless, "an arm's velocity: a zero does not leave it where it is"}},
      {{"arm/*", "*_arm/*", "arm_controller/*", "*_arm_controller/*", "*cartesian*",
        "*servo_server/*", "manipulator/*", "gripper/*", "*_gripper/*", "*gripper_controller/*",
        "*end_effector*", "jog_*"},
       {kTwist},
       {kEndless, "an arm's velocity: a zero does not leave it where it is"}},
      {{"*mavros/setpoint_*", "*setpoint_velocity/*", "*drone*/cmd_vel", "*uav*/cmd_vel",
        "*copter*/cmd_vel", "*quadrotor*/cmd_vel", "bebop/cmd_vel", "tello/cmd_vel",
        "ardrone/cmd_vel"},
       {},
       {kEndless, "a flying robot's: a zero leaves it in the air"}},
      {{"mobile_base/commands/velocity", "servoing_cmd_vel", "base_controller/command",
        "*_controller/cmd_vel", "twist_mux/*", "*mux/output*", "*mux/cmd_vel*"},
       {kTwist, kAckermann},
       {kOther, "the base behind its multiplexer: nobody could override it"}},
      {{"local_position/*", "gps/*", "imu/*", "*odom*", "*estimate*", "*measured*", "*actual*",
        "*feedback*", "*state*", "fix_velocity", "vel"},
       {"geometry_msgs/TwistStamped", "geometry_msgs/TwistWithCovariance*"},
       {kOther, "a velocity that was measured"}},
      {{"*safe_command", "*joint_speed"},
       {},
       {kEndless, "what stops it is not known to the player"}},
      {{"dynamixel_workbench/*", "set_joint_trajectory*"},
       {"trajectory_msgs/*"},
       {kEndless, "what stops it is not known to the player"}},
      {{"*scan", "*scan_raw", "*scan_filtered"},
       {"sensor_msgs/LaserScan"},
       {kOther, "a live sensor's: old ranges hide people; it can be drawn under another name"}},
      {{"*camera*", "*depth*", "*velodyne*", "*lidar*", "*laser*"},
       {"sensor_msgs/PointCloud2"},
       {kOther, "a live sensor's: planners take it; it can be drawn under another name"}},
      // A client would take a recorded answer for that of its own goal.
      {{"result", "feedback", "status"},
       {},
       {kOther, "an answer of the robot; it gives a new one"}},
      {{},
       {"*ActionResult", "*ActionFeedback", "actionlib_msgs/GoalStatusArray"},
       {kOther, "an answer of the robot; it gives a new one"}}};
  return rules;
}

/// What drivers of arms, hands and flying robots obey, by messages of their own.
const Rules& driverRules() {
  constexpr auto kEndless = TopicClass::Endless;
  constexpr std::string_view kDriver = "its driver goes on with it, whoever is gone";
  static const Rules rules{
      {{},
       {"kinova_msgs/JointVelocity", "kinova_msgs/PoseVelocity*", "kinova_msgs/JointTorque",
        "kinova_msgs/CartesianForce", "kortex_driver/TwistCommand",
        "kortex_driver/Base_JointSpeeds", "baxter_core_msgs/*Command", "intera_core_msgs/*Command",
        "naoqi_bridge_msgs/JointAngles*", "*/*_robot_output", "*/*RobotOutput", "mav_msgs/*",
        "mavros_msgs/*Target", "mavros_msgs/*Control", "hector_uav_msgs/*Command",
        "dbw_*_msgs/*Cmd", "autoware_msgs/*Command*", "autoware_msgs/VehicleCmd"},
       {kEndless, kDriver}},
      {{"command/*"}, {"iiwa_msgs/*", "geometry_msgs/*", "std_msgs/Float*"}, {kEndless, kDriver}},
      {{"commands/*"}, {"std_msgs/Float*"}, {kEndless, kDriver}},
      {{"*command", "*commands", "*_cmd", "*goal", "*target", "*setpoint"},
       {"sensor_msgs/JointState"},
       {kEndless, kDriver}},
      {{"*pwm*", "*throttle*", "*motor_speed*", "*motor_cmd*"},
       {"std_msgs/*"},
       {kEndless, "motors go on with it, whoever is gone"}},
      {{"*equilibrium_pose", "*target_frame", "*setpoint_position/*", "*cmd_pose", "*pose_cmd",
        "*go_to_pose", "*goto_pose"},
       {kPose},
       {kEndless, "who is sent there goes on when the player is gone"}},
      {{"takeoff", "land", "dock", "undock"},
       {"std_msgs/*"},
       {kEndless, "what it begins goes on when the player is gone"}}};
  return rules;
}

/// Topics that speak or are drawn.
const Rules& shownRules() {
  constexpr auto kShown = TopicClass::Shown;
  static const Rules rules{
      {{}, {"sound_play/SoundRequest*", "*/TtsActionGoal"}, {kShown, "speech"}},
      {{"sound_play/cancel", "tts/cancel"}, {"actionlib_msgs/GoalID"}, {kShown, "speech"}},
      {{}, {"turtlebot3_msgs/Sound", "kobuki_msgs/Sound"}, {kShown, "a sound"}},
      {{},
       {"visualization_msgs/Marker", "visualization_msgs/MarkerArray", "nav_msgs/Path",
        "sensor_msgs/PointCloud2", "sensor_msgs/LaserScan"},
       {kShown, "it can be drawn"}},
      {{"current_goal"}, {"geometry_msgs/PoseStamped"}, {kShown, "it can be drawn"}},
      {{"footprint"}, {"geometry_msgs/PolygonStamped"}, {kShown, "it can be drawn"}}};
  return rules;
}

/// Goals of the body whose servers send goals of their own to its controllers.
const Rules& byNameRules() {
  static const Rules rules{
      {{"execute_trajectory/goal", "play_motion/goal"},
       {"*ActionGoal"},
       {TopicClass::Body, "it has controllers sent goals of their own, which are played instead",
        StopKind::Cancel},
       true}};
  return rules;
}

/// Topics that move a robot, by how they are stopped.
const Rules& motionRules() {
  constexpr auto kBody = TopicClass::Body, kOther = TopicClass::Other;
  constexpr auto kEndless = TopicClass::Endless;
  static const Rules rules{
      {{},
       {"geometry_msgs/Twist", "geometry_msgs/TwistStamped"},
       {kBody, "a zero stops it", StopKind::Zero}},
      {{},
       {"ackermann_msgs/AckermannDrive", "ackermann_msgs/AckermannDriveStamped"},
       {kBody, "speed 0 stops it, its steering is kept", StopKind::Speed}},
      {{},
       {"trajectory_msgs/JointTrajectory"},
       {kBody, "an empty trajectory stops it", StopKind::NoPoints}},
      {{},
       {"control_msgs/FollowJointTrajectoryActionGoal", "*/JointTrajectoryActionGoal",
        "*/PointHeadActionGoal", "*/SingleJointPositionActionGoal"},
       {kBody, "a cancel stops it", StopKind::Cancel}},
      {{},
       {"control_msgs/GripperCommandActionGoal"},
       {kBody, "a gripper: it stops where it is told to go", StopKind::Cancel}},
      // PR2's gripper without effort drops what it holds: a cancel does that.
      {{},
       {"pr2_controllers_msgs/Pr2GripperCommand*"},
       {kBody, "a gripper: it stops where it is told to go", StopKind::EndsItself}},
      {{"follow_joint_trajectory/cancel", "joint_trajectory_action/cancel", "point_head/cancel",
        "point_head_action/cancel", "position_joint_action/cancel", "gripper_action/cancel",
        "gripper_cmd/cancel"},
       {"actionlib_msgs/GoalID"},
       {kBody, "it cancels a goal of the body", StopKind::IsStop}},
      {{},
       {"actionlib_msgs/GoalID"},
       {kOther, "it cancels goals that are not replayed", StopKind::IsStop}},
      {{}, {"*ActionGoal"}, {kOther, "an action that goes its own way today", StopKind::Cancel}},
      // ros_controllers' controllers of velocities, one joint or a group: by the names that their
      // configurations have, as the message does not say what its numbers are.
      {{"*vel_controller/command", "*velocity_controller/command",
        "*velocity_controllers/command"},
       {"std_msgs/Float64", "std_msgs/Float64MultiArray"},
       {kBody, "joints' velocities, by the controller's name: zeros stop it", StopKind::Zero}},
      {{},
       {"ackermann_msgs/*", "trajectory_msgs/*", "brics_actuator/Joint*", "control_msgs/JointJog"},
       {kEndless, "no message stops it, and the last one holds"}},
      {{"*command", "*commands", "*cmd", "*point", "*velocity", "*effort", "*position", "*target",
        "*_controller/*"},
       {"std_msgs/Float*", "geometry_msgs/Wrench*"},
       {kEndless, "its controller goes on with the last value, whoever is gone"}},
      {{"set_traj_cmd", "set_periodic_cmd"},
       {},
       {kEndless, "its controller goes on with it, whoever is gone"}},
      {{"*script_command", "*URScript", "*urscript"}, {}, {kEndless, "it runs any program"}},
      {{"goal", "*command", "*commands"},
       {"geometry_msgs/Pose*"},
       {kEndless, "who is sent there goes on when the player is gone"}},
      {{"command", "commands", "cmd_vel", "goal"},
       {},
       {kEndless, "by its name it moves something, and what stops that is not known"}}};
  return rules;
}

/// Beliefs about the world or the robot.
const Rules& stateRules() {
  constexpr auto kOther = TopicClass::Other;
  constexpr std::string_view kLog = "a log of nodes, evidence only";
  static const Rules rules{
      // Two sources of one transform fight, and old stamps are refused (geometry2 issues 43, 64).
      {{"tf", "tf_static"},
       {},
       {kOther, "transforms come from the robot itself; recorded ones place the recording"}},
      {{},
       {"*/TFMessage", "*/tfMessage"},
       {kOther, "transforms come from the robot itself; recorded ones place the recording"}},
      {{"rosout", "rosout_agg"}, {}, {kOther, kLog}},
      {{}, {"rosgraph_msgs/*", "diagnostic_msgs/*"}, {kOther, kLog}},
      {{"joint_states"}, {}, {kOther, "the robot's state then; it has another now"}},
      {{}, {"nav_msgs/Odometry"}, {kOther, "the robot's state then; it has another now"}},
      {{"robot_state", "gripper_state", "battery_state", "power_board/state", "power_status",
        "dashboard_agg", "robot_status", "robot_program_running", "robot_mode", "safety_mode"},
       {},
       {kOther, "the robot's state then; guards go by it"}},
      {{}, {"nav_msgs/OccupancyGrid", "map_msgs/*"}, {kOther, "planners go by it"}},
      {{"planning_scene", "planning_scene_world", "collision_object", "attached_collision_object"},
       {},
       {kOther, "planners go by it"}},
      {{"reset", "*reset_odometry"}, {"std_msgs/*"}, {kOther, "odometry would jump"}},
      {{"parameter_updates", "parameter_descriptions"}, {}, {kOther, "a node's settings then"}},
      {{}, {"kobuki_msgs/*"}, {kOther, "a switch or a state of the base"}},
      {{}, {"sensor_msgs/*"}, {kOther, "a live sensor's"}}};
  return rules;
}

// Types that make a robot move wherever they are sent.
constexpr std::array<std::string_view, 7> kMotionTypes{"geometry_msgs/Twist",
                                                       "geometry_msgs/TwistStamped",
                                                       "trajectory_msgs/JointTrajectory",
                                                       "trajectory_msgs/MultiDOFJointTrajectory",
                                                       "ackermann_msgs/AckermannDrive",
                                                       "ackermann_msgs/AckermannDriveStamped",
                                                       "actionlib_msgs/GoalID"};

// Last names of topics that make a robot move, whatever they carry (a Float64 for one joint's
// controller, a PoseStamped for move_base_simple): `--only ar` must not move anything.
constexpr std::array<std::string_view, 4> kMotionTopics{"command", "commands", "cmd_vel", "goal"};

/// The first row that fits; null: none does.
const TopicRow* rowIn(const Rules& rows, std::string_view topic, std::string_view type) {
  const auto row = std::find_if(rows.begin(), rows.end(),
                                [&](const TopicRow& one) { return one.holds(topic, type); });
  return row != rows.end() ? &*row : nullptr;
}

bool speaks(std::string_view topic, std::string_view type) {
  // sound_play has an action too; its goal speaks, and its cancel is known by the topic alone.
  return startsWith(type, "sound_play/") || endsWith(type, "/TtsActionGoal") ||
         type == "turtlebot3_msgs/Sound" || type == "kobuki_msgs/Sound" ||
         endsWith(topic, "/sound_play/cancel") || endsWith(topic, "/tts/cancel");
}

}  // namespace

std::string_view name(Modality modality) {
  switch (modality) {
    case Modality::Body:
      return "body";
    case Modality::Ar:
      return "ar";
    case Modality::Speech:
      return "speech";
  }
  return "";
}

Modality modalityOf(std::string_view topic, std::string_view type) {
  if (speaks(topic, type)) return Modality::Speech;
  const bool moves = endsWith(type, "ActionGoal") || startsWith(type, "control_msgs/") ||
                     isOneOf(type, kMotionTypes) || isOneOf(lastName(topic), kMotionTopics) ||
                     roleOf(topic, type).topic_class == TopicClass::Endless;
  return moves ? Modality::Body : Modality::Ar;
}

std::string_view name(TopicClass topic_class) {
  switch (topic_class) {
    case TopicClass::Body:
      return "body";
    case TopicClass::Shown:
      return "shown";
    case TopicClass::Control:
      return "control input";
    case TopicClass::Endless:
      return "endless motion";
    case TopicClass::Other:
      return "other";
  }
  return "";
}

bool isCalled(std::string_view topic, std::string_view pattern) {
  if (startsWith(pattern, "/")) return matches(topic, pattern);
  for (std::size_t slash = topic.find('/'); slash != std::string_view::npos;
       slash = topic.find('/', slash + 1)) {
    if (matches(topic.substr(slash + 1), pattern)) return true;
    if (startsWith(pattern, "*")) return false;  // the rest is what * has stood for already
  }
  return false;
}

bool TopicRow::holds(std::string_view topic, std::string_view type) const {
  const auto is_name = [&](std::string_view pattern) { return isCalled(topic, pattern); };
  const auto is_type = [&](std::string_view pattern) { return matches(type, pattern); };
  return (types.empty() || std::any_of(types.begin(), types.end(), is_type)) &&
         (names.empty() || std::any_of(names.begin(), names.end(), is_name));
}

const std::vector<TopicRow>& topicTable() {
  // In this order: inputs are inputs whatever their type is, and known names of other topics count
  // before the type.
  static const std::vector<TopicRow> table = [] {
    std::vector<TopicRow> rows;
    for (const Rules* rules : {&controlRules(), &exceptionRules(), &driverRules(), &shownRules(),
                               &stateRules(), &byNameRules(), &motionRules()}) {
      rows.insert(rows.end(), rules->begin(), rules->end());
    }
    return rows;
  }();
  return table;
}

TopicRole roleOf(std::string_view topic, std::string_view type) {
  const TopicRow* row = rowIn(topicTable(), topic, type);
  return row ? row->role : TopicRole{TopicClass::Other, "what acts on it is not known"};
}

bool isByName(std::string_view topic, std::string_view type) {
  const TopicRow* row = rowIn(topicTable(), topic, type);
  return row && row->is_by_name;
}

std::vector<std::string_view> bodyTypes() {
  std::vector<std::string_view> types;
  for (const RoleRule& rule : motionRules()) {
    const bool moves = rule.role.topic_class == TopicClass::Body &&
                       rule.role.stop != StopKind::IsStop;
    if (moves) types.insert(types.end(), rule.types.begin(), rule.types.end());
  }
  return types;
}

StopKind knownStop(std::string_view topic, std::string_view type) {
  const TopicRow* row = rowIn(motionRules(), topic, type);
  return row ? row->role.stop : StopKind::None;
}

}  // namespace afterglow::replay
