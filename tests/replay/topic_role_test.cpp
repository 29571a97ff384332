#include "replay/messages/topic_name.hpp"
#include "replay/plan/topic_role.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "replay/plan/play_plan.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::replay::topic_role_test {
namespace {

TEST(TopicRole, bodyIsWhatMovesARobot) {
  const auto expectBody = [](const char* topic, const char* type) {
    EXPECT_EQ(modalityOf(topic, type), Modality::Body) << topic << " " << type;
  };
  expectBody("/cmd_vel", "geometry_msgs/Twist");
  expectBody("/base/mux/input", "geometry_msgs/TwistStamped");
  expectBody("/arm_with_torso_controller/follow_joint_trajectory/goal",
             "control_msgs/FollowJointTrajectoryActionGoal");
  expectBody("/arm_with_torso_controller/follow_joint_trajectory/cancel", "actionlib_msgs/GoalID");
  expectBody("/gripper_controller/gripper_action/goal", "control_msgs/GripperCommandActionGoal");
  expectBody("/arm_controller/command", "trajectory_msgs/JointTrajectory");
  expectBody("/head_pan_controller/command", "std_msgs/Float64");
  expectBody("/move_base_simple/goal", "geometry_msgs/PoseStamped");
}

TEST(TopicRole, speechIsSoundPlayAndTts) {
  EXPECT_EQ(modalityOf("/robotsound", "sound_play/SoundRequest"), Modality::Speech);
  EXPECT_EQ(modalityOf("/sound_play/goal", "sound_play/SoundRequestActionGoal"), Modality::Speech);
  EXPECT_EQ(modalityOf("/sound_play/cancel", "actionlib_msgs/GoalID"), Modality::Speech);
  EXPECT_EQ(modalityOf("/tts/goal", "pal_interaction_msgs/TtsActionGoal"), Modality::Speech);
}

TEST(TopicRole, isNamed) {
  EXPECT_EQ(name(Modality::Body), "body");
  EXPECT_EQ(name(Modality::Ar), "ar");
  EXPECT_EQ(name(Modality::Speech), "speech");
  EXPECT_EQ(name(TopicClass::Control), "control input");
  EXPECT_EQ(name(TopicClass::Endless), "endless motion");
}

TEST(TopicRole, takesWholeNamesOnly) {
  for (const char* topic : {"/my_tf_markers", "/results", "/goals", "/joystick_help"}) {
    EXPECT_EQ(roleOf(topic, "visualization_msgs/Marker").topic_class, TopicClass::Shown) << topic;
  }
  EXPECT_EQ(roleOf("/a/result", "control_msgs/PointHeadActionResult").why,
            "an answer of the robot; it gives a new one");
}

// ------------------------------------------------------------------------------- of real robots

struct RealTopic {
  std::string topic, type;
};

/// Fetch, TIAGo, PR2, TurtleBot 2 and 3, UR, MoveIt, navigation: which packages publish and hear
/// these is in the sources that topic_role.hpp names.
using RealTopics = std::map<TopicClass, std::vector<RealTopic>>;

std::vector<RealTopic> bodyTopics() {
  const std::string follow = "control_msgs/FollowJointTrajectoryActionGoal";
  const std::string command = "trajectory_msgs/JointTrajectory", twist = "geometry_msgs/Twist";
  return {{"/arm_controller/follow_joint_trajectory/goal", follow},
          {"/arm_with_torso_controller/follow_joint_trajectory/goal", follow},
          {"/torso_controller/follow_joint_trajectory/goal", follow},
          {"/head_controller/follow_joint_trajectory/goal", follow},
          {"/gripper_controller/follow_joint_trajectory/goal", follow},
          {"/parallel_gripper_controller/follow_joint_trajectory/goal", follow},
          {"/r_arm_controller/follow_joint_trajectory/goal", follow},
          {"/scaled_pos_joint_traj_controller/follow_joint_trajectory/goal", follow},
          {"/arm_controller/follow_joint_trajectory/cancel", "actionlib_msgs/GoalID"},
          {"/r_arm_controller/joint_trajectory_action/goal",
           "pr2_controllers_msgs/JointTrajectoryActionGoal"},
          {"/head_controller/point_head/goal", "control_msgs/PointHeadActionGoal"},
          {"/head_controller/point_head_action/goal", "control_msgs/PointHeadActionGoal"},
          {"/head_traj_controller/point_head_action/goal",
           "pr2_controllers_msgs/PointHeadActionGoal"},
          {"/torso_controller/position_joint_action/goal",
           "pr2_controllers_msgs/SingleJointPositionActionGoal"},
          {"/gripper_controller/gripper_action/goal", "control_msgs/GripperCommandActionGoal"},
          {"/hand/gripper_cmd/goal", "control_msgs/GripperCommandActionGoal"},
          {"/r_gripper_controller/gripper_action/goal",
           "pr2_controllers_msgs/Pr2GripperCommandActionGoal"},
          {"/r_gripper_controller/command", "pr2_controllers_msgs/Pr2GripperCommand"},
          {"/arm_controller/command", command},
          {"/l_arm_controller/command", command},
          {"/cmd_vel", twist},
          {"/nav_vel", twist},
          {"/cmd_vel_mux/input/navi", twist},
          {"/navigation/cmd_vel", twist},
          {"/ackermann_cmd", "ackermann_msgs/AckermannDrive"},
          {"/ackermann_cmd_mux/input/navigation", "ackermann_msgs/AckermannDriveStamped"},
          {"/joint_group_vel_controller/command", "std_msgs/Float64MultiArray"},
          {"/arm_forward_velocity_controller/command", "std_msgs/Float64MultiArray"},
          {"/wheel_velocity_controller/command", "std_msgs/Float64"},
          {"/turtle1/cmd_vel", twist},
          {"/pepper/cmd_vel", twist},
          {"/navigation_velocity_smoother/raw_cmd_vel", twist},
          {"/joint_path_command", command},
          {"/my_gen3/my_gen3_joint_trajectory_controller/follow_joint_trajectory/goal", follow},
          {"/franka_gripper/gripper_action/goal", "control_msgs/GripperCommandActionGoal"}};
}

/// Of the body, and played only if they are named: they have controllers sent goals of their own.
std::vector<RealTopic> byNameTopics() {
  return {{"/execute_trajectory/goal", "moveit_msgs/ExecuteTrajectoryActionGoal"},
          {"/play_motion/goal", "play_motion_msgs/PlayMotionActionGoal"}};
}

/// Of bodyTopics(), those that others of them are sent for or send: TIAGo's gripper, PR2's.
const std::vector<std::string> kNested{"/parallel_gripper_controller/follow_joint_trajectory/goal",
                                       "/r_gripper_controller/command"};

std::vector<RealTopic> shownTopics() {
  return {{"/move_base/NavfnROS/plan", "nav_msgs/Path"},
          {"/move_base/TrajectoryPlannerROS/global_plan", "nav_msgs/Path"},
          {"/move_base/TrajectoryPlannerROS/local_plan", "nav_msgs/Path"},
          {"/move_base/current_goal", "geometry_msgs/PoseStamped"},
          {"/move_base/local_costmap/footprint", "geometry_msgs/PolygonStamped"},
          {"/visualization_marker", "visualization_msgs/Marker"},
          {"/visualization_marker_array", "visualization_msgs/MarkerArray"},
          {"/twist_marker", "visualization_msgs/Marker"},
          {"/projector/green_points", "sensor_msgs/PointCloud2"},
          {"/projector/nav/path", "visualization_msgs/MarkerArray"},
          {"/base_scan_obstacles_only", "sensor_msgs/LaserScan"},
          {"/robotsound", "sound_play/SoundRequest"},
          {"/sound_play/goal", "sound_play/SoundRequestActionGoal"},
          {"/sound_play/cancel", "actionlib_msgs/GoalID"},
          {"/tts/goal", "pal_interaction_msgs/TtsActionGoal"},
          {"/sound", "turtlebot3_msgs/Sound"},
          {"/mobile_base/commands/sound", "kobuki_msgs/Sound"}};
}

std::vector<RealTopic> controlTopics() {
  const std::string twist = "geometry_msgs/Twist", flag = "std_msgs/Bool";
  return {{"/joy", "sensor_msgs/Joy"},
          {"/joy_orig", "sensor_msgs/Joy"},
          {"/spacenav/joy", "sensor_msgs/Joy"},
          {"/joy/set_feedback", "sensor_msgs/JoyFeedbackArray"},
          {"/initialpose", "geometry_msgs/PoseWithCovarianceStamped"},
          {"/clock", "rosgraph_msgs/Clock"},
          {"/teleop/cmd_vel", twist},
          {"/joy_vel", twist},
          {"/key_vel", twist},
          {"/tab_vel", twist},
          {"/phone_vel", twist},
          {"/marker_vel", twist},
          {"/rviz_joy_vel", twist},
          {"/input_joy/cmd_vel", twist},
          {"/cmd_vel_mux/input/teleop", twist},
          {"/cmd_vel_mux/input/switch", twist},
          {"/cmd_vel_mux/input/safety_controller", twist},
          {"/bluetooth_teleop/cmd_vel", twist},
          {"/cmd_vel_joy", twist},
          {"/twist_marker_server/cmd_vel", twist},
          {"/teleop_velocity_smoother/raw_cmd_vel", twist},
          {"/stop", "std_msgs/Empty"},
          {"/my_gen3/in/emergency_stop", "std_msgs/Empty"},
          {"/robot/set_super_enable", flag},
          {"/franka_control/error_recovery/goal", "franka_msgs/ErrorRecoveryActionGoal"},
          {"/joy_priority", flag},
          {"/pause_navigation", flag},
          {"/stop_closing_loop", flag},
          {"/emergency_brake", flag},
          {"/joy_priority_action/goal", "twist_mux_msgs/JoyPriorityActionGoal"},
          {"/joy_turbo_increase/goal", "twist_mux_msgs/JoyTurboActionGoal"},
          {"/enable_software_runstop", flag},
          {"/software_runstop_enabled", flag},
          {"/gripper/gripper_breaker_enabled", flag},
          {"/pr2_ethercat/motors_halted", flag},
          {"/power/is_emergency", flag},
          {"/estop", flag},
          {"/motor_power", flag},
          {"/mobile_base/commands/motor_power", "kobuki_msgs/MotorPower"},
          {"/clicked_point", "geometry_msgs/PointStamped"},
          {"/trajectory_execution_event", "std_msgs/String"},
          {"/interactive_markers/feedback", "visualization_msgs/InteractiveMarkerFeedback"}};
}

std::vector<RealTopic> endlessTopics() {
  const std::string group = "std_msgs/Float64MultiArray";
  return {{"/joint_group_position_controller/command", group},
          {"/joint_group_effort_controller/command", group},
          {"/group_controller/velocity", group},
          {"/head_pan_controller/command", "std_msgs/Float64"},
          {"/joint_position_controller/set_point", "std_msgs/Float64"},
          {"/wheel_left/effort", "std_msgs/Float64"},
          {"/twist_controller/command", "geometry_msgs/Twist"},
          {"/arm_controller/cartesian_twist/command", "geometry_msgs/TwistStamped"},
          {"/servo_server/delta_twist_cmds", "geometry_msgs/TwistStamped"},
          {"/torso_controller/safe_command", "trajectory_msgs/JointTrajectory"},
          {"/ur_driver/joint_speed", "trajectory_msgs/JointTrajectory"},
          {"/drone/command/trajectory", "trajectory_msgs/MultiDOFJointTrajectory"},
          {"/move_base_simple/goal", "geometry_msgs/PoseStamped"},
          {"/laser_tilt_controller/set_traj_cmd", "pr2_msgs/LaserTrajCmd"},
          {"/laser_tilt_controller/set_periodic_cmd", "pr2_msgs/PeriodicCmd"},
          {"/ur_hardware_interface/script_command", "std_msgs/String"},
          {"/ur_driver/URScript", "std_msgs/String"},
          {"/my_arm/command", "my_msgs/Anything"},
          {"/servo_server/delta_joint_cmds", "control_msgs/JointJog"},
          {"/left_arm/cmd_vel", "geometry_msgs/Twist"},
          {"/mavros/setpoint_velocity/cmd_vel_unstamped", "geometry_msgs/Twist"},
          {"/mavros/setpoint_velocity/cmd_vel", "geometry_msgs/TwistStamped"},
          {"/mavros/setpoint_position/local", "geometry_msgs/PoseStamped"},
          {"/mavros/setpoint_raw/local", "mavros_msgs/PositionTarget"},
          {"/bebop/cmd_vel", "geometry_msgs/Twist"},
          {"/bebop/takeoff", "std_msgs/Empty"},
          {"/j2n6s300_driver/in/joint_velocity", "kinova_msgs/JointVelocity"},
          {"/j2n6s300_driver/in/cartesian_velocity", "kinova_msgs/PoseVelocity"},
          {"/my_gen3/in/cartesian_velocity", "kortex_driver/TwistCommand"},
          {"/iiwa/command/JointPosition", "iiwa_msgs/JointPosition"},
          {"/robot/limb/right/joint_command", "baxter_core_msgs/JointCommand"},
          {"/robot/head/command_head_pan", "baxter_core_msgs/HeadPanCommand"},
          {"/cartesian_impedance_example_controller/equilibrium_pose", "geometry_msgs/PoseStamped"},
          {"/joint_command", "sensor_msgs/JointState"},
          {"/joint_angles", "naoqi_bridge_msgs/JointAnglesWithSpeed"},
          {"/dynamixel_workbench/joint_trajectory", "trajectory_msgs/JointTrajectory"},
          {"/set_joint_trajectory", "trajectory_msgs/JointTrajectory"},
          {"/Robotiq2FGripperRobotOutput",
           "robotiq_2f_gripper_control/Robotiq2FGripper_robot_output"},
          {"/vesc/commands/motor/speed", "std_msgs/Float64"},
          {"/spot/go_to_pose", "geometry_msgs/PoseStamped"},
          {"/dock", "std_msgs/Empty"}};
}

std::vector<RealTopic> actionsAndBases() {
  const std::string twist = "geometry_msgs/Twist";
  return {{"/move_base/goal", "move_base_msgs/MoveBaseActionGoal"},
          {"/move_base/cancel", "actionlib_msgs/GoalID"},
          {"/move_group/goal", "moveit_msgs/MoveGroupActionGoal"},
          {"/pickup/goal", "moveit_msgs/PickupActionGoal"},
          {"/spot/trajectory/goal", "spot_msgs/TrajectoryActionGoal"},
          {"/j2n6s300_driver/joints_action/joint_angles/goal",
           "kinova_msgs/ArmJointAnglesActionGoal"},
          {"/husky_velocity_controller/cmd_vel", twist},
          {"/jackal_velocity_controller/cmd_vel", twist},
          {"/twist_mux/cmd_vel", twist},
          {"/vel", "geometry_msgs/TwistStamped"},
          {"/mavros/local_position/velocity_local", "geometry_msgs/TwistStamped"},
          {"/dock/goal", "fetch_auto_dock_msgs/DockActionGoal"},
          {"/query_controller_states/goal",
           "robot_controllers_msgs/QueryControllerStatesActionGoal"},
          {"/torso_controller/increment/goal", "teleop_tools_msgs/IncrementActionGoal"},
          {"/mobile_base_controller/cmd_vel", twist},
          {"/mobile_base/commands/velocity", twist},
          {"/servoing_cmd_vel", twist},
          {"/base_controller/command", twist},
          {"/cmd_vel_mux/active", "std_msgs/String"},
          {"/cmd_vel_mux/selected", "std_msgs/String"},
          {"/cmd_vel_out", "geometry_msgs/TwistStamped"},
          {"/cmd_vel_rc100", twist},
          {"/mobile_base/commands/external_power", "kobuki_msgs/ExternalPower"},
          {"/mobile_base/commands/reset_odometry", "std_msgs/Empty"},
          {"/mobile_base/events/bumper", "kobuki_msgs/BumperEvent"},
          {"/reset", "std_msgs/Empty"}};
}

std::vector<RealTopic> states() {
  const std::string odometry = "nav_msgs/Odometry";
  return {{"/tf", "tf2_msgs/TFMessage"},
          {"/tf_static", "tf2_msgs/TFMessage"},
          {"/robot1/tf", "tf/tfMessage"},
          {"/rosout", "rosgraph_msgs/Log"},
          {"/diagnostics", "diagnostic_msgs/DiagnosticArray"},
          {"/diagnostics_agg", "diagnostic_msgs/DiagnosticArray"},
          {"/joint_states", "sensor_msgs/JointState"},
          {"/odom", odometry},
          {"/base_odometry/odom", odometry},
          {"/robot_pose_ekf/odom_combined", "geometry_msgs/PoseWithCovarianceStamped"},
          {"/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped"},
          {"/particlecloud", "geometry_msgs/PoseArray"},
          {"/map", "nav_msgs/OccupancyGrid"},
          {"/map_updates", "map_msgs/OccupancyGridUpdate"},
          {"/move_base/local_costmap/costmap", "nav_msgs/OccupancyGrid"},
          {"/base_scan", "sensor_msgs/LaserScan"},
          {"/base_scan_raw", "sensor_msgs/LaserScan"},
          {"/scan", "sensor_msgs/LaserScan"},
          {"/scan_raw", "sensor_msgs/LaserScan"},
          {"/tilt_scan", "sensor_msgs/LaserScan"},
          {"/head_camera/depth_registered/points", "sensor_msgs/PointCloud2"},
          {"/head_camera/rgb/image_raw", "sensor_msgs/Image"},
          {"/imu", "sensor_msgs/Imu"},
          {"/robot_state", "fetch_driver_msgs/RobotState"},
          {"/power_board/state", "pr2_msgs/PowerBoardState"},
          {"/ur_hardware_interface/robot_program_running", "std_msgs/Bool"},
          {"/speed_scaling_factor", "std_msgs/Float64"},
          {"/wrench", "geometry_msgs/WrenchStamped"},
          {"/head_controller/state", "control_msgs/JointTrajectoryControllerState"},
          {"/arm_controller/follow_joint_trajectory/result",
           "control_msgs/FollowJointTrajectoryActionResult"},
          {"/arm_controller/follow_joint_trajectory/feedback",
           "control_msgs/FollowJointTrajectoryActionFeedback"},
          {"/move_group/status", "actionlib_msgs/GoalStatusArray"},
          {"/planning_scene", "moveit_msgs/PlanningScene"},
          {"/collision_object", "moveit_msgs/CollisionObject"},
          {"/move_group/display_planned_path", "moveit_msgs/DisplayTrajectory"},
          {"/amcl/parameter_updates", "dynamic_reconfigure/Config"},
          {"/audio/audio", "audio_common_msgs/AudioData"},
          {"/gripper_state", "fetch_driver_msgs/GripperState"},
          {"/ur_hardware_interface/safety_mode", "ur_dashboard_msgs/SafetyMode"},
          {"/spot/status/feedback", "spot_msgs/Feedback"},
          {"/say", "std_msgs/String"},
          {"/voice_command", "std_msgs/String"}};
}

RealTopics realTopics() {
  RealTopics table{{TopicClass::Body, bodyTopics()},
                   {TopicClass::Shown, shownTopics()},
                   {TopicClass::Control, controlTopics()},
                   {TopicClass::Endless, endlessTopics()},
                   {TopicClass::Other, actionsAndBases()}};
  for (RealTopic& topic : states()) table[TopicClass::Other].push_back(std::move(topic));
  for (RealTopic& topic : byNameTopics()) table[TopicClass::Body].push_back(std::move(topic));
  return table;
}

TEST(TopicRole, isNotKnownForNamesThatNoTopicHas) {
  std::string name;
  while (name.size() < 500'000) name += "/joint_trajectory";
  EXPECT_EQ(roleOf(name + "/goal", name).topic_class, TopicClass::Other);
  const std::string longest = "/" + std::string(TopicName::kLongest - 9, 'a') + "/cmd_vel";
  EXPECT_EQ(roleOf(longest, "geometry_msgs/Twist").topic_class, TopicClass::Body);
  const std::string base =
      "/" + std::string(TopicName::kLongest - 25, 'a') + "/base_controller/command";
  ASSERT_EQ(base.size(), TopicName::kLongest);
  EXPECT_EQ(roleOf(base, "geometry_msgs/Twist").topic_class, TopicClass::Other);
}

TEST(TopicRole, isKnownForRealTopics) {
  std::size_t count = 0;
  for (const auto& [expected, topics] : realTopics()) {
    for (const RealTopic& real : topics) {
      EXPECT_EQ(name(roleOf(real.topic, real.type).topic_class), name(expected))
          << real.topic << " " << real.type;
      EXPECT_EQ(name(roleOf("/robot1" + real.topic, real.type).topic_class), name(expected))
          << real.topic << " " << real.type << ", of one robot of several";
      EXPECT_NE(roleOf(real.topic, real.type).why, "");
      EXPECT_TRUE(expected != TopicClass::Body ||
                  knownStop(real.topic, real.type) != StopKind::None)
          << real.topic;
      ++count;
    }
  }
  EXPECT_GE(count, 190u);
}

/// "TOPIC TYPE | class | stop | its motion's stop | modality", and " | by name".
std::string roleLine(const std::string& topic, const std::string& type) {
  constexpr const char* kStops[] = {"none",   "zero",   "speed",       "fields",
                                    "empty", "cancel", "ends_itself", "is_stop"};
  const TopicRole role = roleOf(topic, type);
  const TopicRow* row = TopicTable::ofAllRobots().rowOf(topic, type);
  const auto stop = [&](StopKind kind) { return kStops[static_cast<std::size_t>(kind)]; };
  return topic + " " + type + " | " + std::string(name(role.topic_class)) + " | " +
         stop(role.stop) + " | " + stop(knownStop(topic, type)) + " | " +
         std::string(name(modalityOf(topic, type))) + (row && row->is_by_name ? " | by name" : "");
}

TEST(TopicRole, isForEveryRowsTopicsAndTypesAsItWas) {
  std::ifstream file("tests/replay/topic_roles.txt");
  std::size_t count = 0;
  for (std::string line; std::getline(file, line); ++count) {
    const std::size_t topic = line.find(' '), type = line.find(" | ");
    EXPECT_EQ(roleLine(line.substr(0, topic), line.substr(topic + 1, type - topic - 1)), line);
  }
  EXPECT_GT(count, 800u);
}

std::string complaintOf(const std::string& rows) {
  try {
    const std::string rest = "motion: []\nunknown: []\nmodalities: []\nnesting: []\n";
    (void)TopicTable::read("my.yaml", rows + rest);
    return "";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(TopicTable, isReadStrictly) {
  const std::string head = "roles:\n  - ";
  EXPECT_EQ(complaintOf(head + "{class: other, topics: [a], why: b}\n"), "");
  EXPECT_EQ(complaintOf(head + "{class: othr, topics: [a], why: b}\n"),
            "my.yaml:2: unknown class 'othr'; did you mean other?");
  EXPECT_EQ(complaintOf(head + "{class: other, topic: [a], why: b}\n"),
            "my.yaml:2: 'topic' is no key here; did you mean topics?");
  EXPECT_EQ(complaintOf(head + "{class: body, topics: [a], why: b, stop: zeros}\n"),
            "my.yaml:2: unknown stop 'zeros'; did you mean zero?");
  EXPECT_EQ(complaintOf(head + "{class: body, topics: [a], why: b}\n"),
            "my.yaml:2: what moves the body has a stop");
  EXPECT_EQ(complaintOf(head + "{class: other, why: b}\n"), "my.yaml:2: the row fits everything");
  EXPECT_EQ(complaintOf(head + "{class: other, topics: a, why: b}\n"),
            "my.yaml:2: 'topics' should be a list");
  EXPECT_EQ(complaintOf(head + "{class: other, topics: [a]}\n"),
            "my.yaml:2: 'why' should be a text");
  EXPECT_EQ(complaintOf(""), "my.yaml:1: 'roles' should be a list");
}

// ------------------------------------------------------------------------------------- in a plan

/// A behavior that holds all of them, and how it came to be.
struct RealBag : testing::Test {
  Behavior behaviorOf(const std::vector<std::string>& requested,
                      const RealTopics& table = realTopics()) {
    Behavior behavior;
    behavior.recording = recording;
    behavior.name = "everything";
    behavior.end = Stamp{1000};
    for (const auto& [expected, topics] : table) {
      for (const RealTopic& real : topics) behavior.topics.push_back(real.topic);
    }
    Snapshot snapshot;
    snapshot.requested = requested;
    behavior.snapshot = snapshot.toJson();
    behavior.id = store->addBehavior(behavior);
    return behavior;
  }
  void SetUp() override {
    std::uint64_t sequence = 0;
    for (const auto& [expected, topics] : realTopics()) {
      for (const RealTopic& real : topics) {
        Message message;
        message.channel =
            store->addChannel(recording, test::channelOf(real.topic, real.type, "string data\n"));
        message.received = {500};
        message.sequence = sequence++;
        message.bytes = Bytes(4, 0);
        store->append({message});
      }
    }
  }
  static std::vector<std::string> names(const std::vector<RealTopic>& topics) {
    std::vector<std::string> found;
    for (const RealTopic& real : topics) found.push_back(real.topic);
    return found;
  }
  static std::vector<std::string> sorted(std::vector<std::string> names) {
    std::sort(names.begin(), names.end());
    return names;
  }
  static std::vector<std::string> with(std::vector<std::string> some,
                                       const std::vector<std::string>& others) {
    some.insert(some.end(), others.begin(), others.end());
    return sorted(some);
  }
  static std::vector<std::string> without(const std::vector<std::string>& all,
                                          const std::vector<std::string>& some) {
    std::vector<std::string> left;
    std::copy_if(all.begin(), all.end(), std::back_inserter(left), [&](const std::string& one) {
      return std::find(some.begin(), some.end(), one) == some.end();
    });
    return sorted(left);
  }
  std::vector<std::string> played(const Behavior& behavior, const PlanOptions& options = {}) {
    return sorted(makePlan(*store, behavior, options).playedTopics());
  }
  static std::vector<std::string> textsOf(const std::vector<TopicName>& topics) {
    std::vector<std::string> texts;
    for (const TopicName& topic : topics) texts.push_back(topic.text());
    return sorted(texts);
  }
  static const PlannedTopic& topicOf(const PlayPlan& plan, const std::string& topic) {
    const auto found =
        std::find_if(plan.topics.begin(), plan.topics.end(),
                     [&](const PlannedTopic& one) { return one.channel.topic == topic; });
    if (found == plan.topics.end()) throw std::logic_error("not planned: " + topic);
    return *found;
  }

  std::unique_ptr<Store> store = openMemoryStore();
  std::int64_t recording = store->addRecording({0, "", "test", ""});
  const std::vector<std::string> body = without(names(bodyTopics()), kNested);
  const std::vector<std::string> shown = names(shownTopics());
};

TEST(Modalities, callLightAsThePageDoes) {
  EXPECT_EQ(parseModalities("light,speech"), parseModalities("ar,speech"));
}

TEST_F(RealBag, ofARequestPlaysBodyLightAndSpeech) {
  std::vector<std::string> all;
  for (const auto& [expected, topics] : realTopics()) {
    const auto some = names(topics);
    all.insert(all.end(), some.begin(), some.end());
  }
  const Behavior behavior = behaviorOf(all);
  EXPECT_EQ(played(behavior), with(body, shown));
  PlanOptions options;
  options.only = parseModalities("ar,speech");
  EXPECT_EQ(played(behavior, options), sorted(shown));
  EXPECT_EQ(makePlan(*store, behavior, options).refusal(), "");
  EXPECT_NE(makePlan(*store, behavior, {}).refusal().find(
                "/drone/command/trajectory (trajectory_msgs/MultiDOFJointTrajectory) is not "
                "played: no message stops it, and the last one holds"),
            std::string::npos)
      << "its body would be played without it";
}

TEST_F(RealBag, ofAnImportOrAPatternShowsNothing) {
  const Behavior behavior = behaviorOf({});
  EXPECT_EQ(played(behavior), body);
  PlanOptions options;
  options.regex = "/.*";
  EXPECT_EQ(played(behavior, options), body) << "a pattern names nothing";
  options.only = parseModalities("ar,speech");
  EXPECT_EQ(played(behavior, options), std::vector<std::string>());
  const PlayPlan plan = makePlan(*store, behavior, options);
  EXPECT_EQ(plan.refusal(), "");
  EXPECT_NE(plan.leftOutText().find(" more; --also /"), std::string::npos) << plan.leftOutText();
  EXPECT_EQ(topicOf(plan, "/robotsound").why_class,
            "speech, but nobody asked for it to be shown");
}

TEST_F(RealBag, playsTheLowestOfNestedGoalsAndWhatIsNamedInsteadOfIt) {
  const Behavior behavior = behaviorOf({});
  PlanOptions options;
  const PlayPlan plan = makePlan(*store, behavior, options);
  EXPECT_EQ(topicOf(plan, "/move_base/goal").why_not.find("the robot sent /"), 0u);
  EXPECT_EQ(topicOf(plan, "/r_gripper_controller/command").why_not,
            "the robot sent it for /r_gripper_controller/gripper_action/goal, which is played");
  options.also = {"/move_base/goal", "/execute_trajectory/goal"};
  const std::vector<std::string> named = played(behavior, options);
  EXPECT_EQ(std::count(named.begin(), named.end(), "/move_base/goal"), 1);
  EXPECT_EQ(std::count(named.begin(), named.end(), "/execute_trajectory/goal"), 1);
  EXPECT_EQ(std::count(named.begin(), named.end(), "/cmd_vel"), 0) << "move_base drives";
  EXPECT_EQ(std::count(named.begin(), named.end(), kNested[0]), 0) << "MoveIt has it sent";
  options.also = {"/move_base/goal", "/cmd_vel"};
  EXPECT_EQ(makePlan(*store, behavior, options).refusal().find("/move_base/goal ("), 0u);
}

TEST_F(RealBag, showsTheLayersOfARunningProjectorButNoLiveSensor) {
  const Behavior behavior = behaviorOf({});
  PlanOptions options;
  options.only = parseModalities("ar");
  options.layers = {"/projector/green_points", "/base_scan", "/then", "/tf", "/cmd_vel"};
  EXPECT_EQ(played(behavior, options), std::vector<std::string>{"/projector/green_points"});
  options.remap = {{"/base_scan", "/then"}};
  EXPECT_EQ(played(behavior, options),
            (std::vector<std::string>{"/base_scan", "/projector/green_points"}))
      << "under a name that nobody but the projector hears";
}

TEST_F(RealBag, publishesWhatIsNamedExactly) {
  const Behavior behavior = behaviorOf({});
  PlanOptions options;
  options.only = parseModalities("ar,speech");
  options.is_motion_allowed = true;
  options.also = {"/voice_command", "/joy", "/tf"};
  PlayPlan plan = makePlan(*store, behavior, options);
  EXPECT_EQ(sorted(plan.playedTopics()), textsOf(options.also));
  EXPECT_EQ(plan.warnings(),
            std::vector<std::string>{"/joy is published as it was recorded: a joystick: base and "
                                     "arm are driven by it"});
  options.also.clear();
  options.settled = {"/voice_command", "/move_base/goal", "/not/recorded"};
  EXPECT_EQ(played(behavior, options), std::vector<std::string>{"/voice_command"})
      << "a setting does not move what was not asked to be moved";
  options.settled.clear();
  options.only.clear();
  options.topics = {"/move_base/goal", "/joy"};
  plan = makePlan(*store, behavior, options);
  EXPECT_EQ(sorted(plan.playedTopics()), with(textsOf(options.topics), {"/move_base/cancel"}));
  EXPECT_EQ(plan.motionTopics(),
            (std::vector<std::string>{"/move_base/cancel", "/move_base/goal"}))
      << "goals are not played without their cancels";
  options.topics = {"/not/recorded"};
  EXPECT_THROW(makePlan(*store, behavior, options), std::invalid_argument);
}

TEST_F(RealBag, refusesMotionThatNothingStopsWhoeverNamesIt) {
  const Behavior behavior = behaviorOf({}, {{TopicClass::Endless, endlessTopics()}});
  for (const RealTopic& real : endlessTopics()) {
    PlanOptions options;
    options.also = {real.topic};
    const PlayPlan plan = makePlan(*store, behavior, options);
    EXPECT_FALSE(topicOf(plan, real.topic).isPlayed()) << real.topic;
    EXPECT_EQ(plan.refusal().find(real.topic + " (" + real.type + ") is not played: "), 0u)
        << plan.refusal();
    options.place = ReplayPlace::Elsewhere;
    EXPECT_NE(makePlan(*store, behavior, options).refusal(), "") << real.topic;
    options.also.clear();
    options.remap = {{real.topic, "/harmless"}};
    EXPECT_FALSE(topicOf(makePlan(*store, behavior, options), real.topic).isPlayed()) << real.topic;
  }
}

TEST_F(RealBag, neverPublishesTheEmergencyStopThatIsObeyed) {
  const Behavior behavior = behaviorOf({});
  PlanOptions options;
  options.also = {"/voice_command"};
  options.remap = {{"/voice_command", "/stop_all"}};
  options.is_motion_allowed = true;
  options.obeyed = {{"/stop_all", "the emergency stop"}};
  EXPECT_EQ(makePlan(*store, behavior, options).refusal(),
            "/voice_command (std_msgs/String) is not played: it is the emergency stop that this "
            "replay obeys; --exclude it to play the rest");
  options.also = {"/estop"};
  EXPECT_EQ(makePlan(*store, behavior, options).refusal(), "") << "another one, which was named";
  EXPECT_EQ(makePlan(*store, behavior, options).warnings().size(), 1u);
}

TEST_F(RealBag, isPlayedAsByRosbagButForMotionAndControlInputsWhereNoRobotIs) {
  const Behavior behavior = behaviorOf({});
  PlanOptions options;
  options.place = ReplayPlace::Elsewhere;
  const PlayPlan plan = makePlan(*store, behavior, options);
  for (const char* topic : {"/tf", "/joint_states", "/odom", "/base_scan", "/map", "/rosout",
                            "/voice_command", "/robotsound", "/projector/green_points"}) {
    EXPECT_TRUE(topicOf(plan, topic).isPlayed()) << topic;
  }
  EXPECT_EQ(plan.motionTopics(), std::vector<std::string>());
  for (const auto& [expected, topics] : realTopics()) {
    if (expected != TopicClass::Control && expected != TopicClass::Endless) continue;
    for (const RealTopic& real : topics) EXPECT_FALSE(topicOf(plan, real.topic).isPlayed());
  }
  options.only = parseModalities("ar,speech");
  EXPECT_EQ(played(behavior, options), sorted(shown));
}

}  // namespace
}  // namespace afterglow::replay::topic_role_test
