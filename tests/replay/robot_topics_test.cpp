#include "replay/plan/robot_profile.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace afterglow::replay::robot_topics_test {
namespace {

constexpr const char* kTwist = "geometry_msgs/Twist";

RobotProfile calling(const std::string& said, const std::vector<std::string>& names) {
  RobotProfile robot;
  robot.name = "test";
  for (const auto& [word, topic_class] : topicClassWords()) {
    if (word == said) robot.topics[topic_class] = names;
  }
  return robot;
}

std::string_view classOf(const RobotProfile& robot, const char* topic, const char* type) {
  return name(RobotTopics(robot).roleOf(topic, type).topic_class);
}

TEST(RobotTopics, withoutAProfileAreTheTables) {
  const RobotTopics none;
  EXPECT_EQ(none.roleOf("/cmd_vel", kTwist).why, roleOf("/cmd_vel", kTwist).why);
  EXPECT_EQ(none.refusal("/cmd_vel", kTwist), "");
}

TEST(RobotTopics, ofAProfileAreStricterAtOnce) {
  EXPECT_EQ(classOf(calling("control", {"drive"}), "/robot1/drive", kTwist), "control input");
  EXPECT_EQ(classOf(calling("endless", {"drive"}), "/drive", kTwist), "endless motion");
  EXPECT_EQ(classOf(calling("other", {"*marks"}), "/my_marks", "visualization_msgs/Marker"),
            "other");
  EXPECT_EQ(classOf(calling("other", {"joy"}), "/joy", "sensor_msgs/Joy"), "control input")
      << "not weaker";
}

TEST(RobotTopics, ofAProfileThatAsksForNothingAreNotRefused) {
  EXPECT_EQ(RobotTopics(calling("other", {"joy"})).refusal("/joy", "sensor_msgs/Joy"), "");
  EXPECT_EQ(RobotTopics(calling("control", {"joy"})).refusal("/joy", "sensor_msgs/Joy"), "");
  EXPECT_NE(RobotTopics(calling("shown", {"joy"})).refusal("/joy", "sensor_msgs/Joy"), "");
}

TEST(RobotTopics, ofAProfileMoveTheBodyOnlyIfTheirStopIsKnown) {
  EXPECT_EQ(classOf(calling("body", {"base_controller/command"}), "/base_controller/command",
                    kTwist),
            "body")
      << "a PR2 without multiplexer";
  const RobotProfile joystick = calling("body", {"joy"});
  EXPECT_EQ(classOf(joystick, "/joy", "sensor_msgs/Joy"), "control input");
  EXPECT_EQ(RobotTopics(joystick).refusal("/joy", "sensor_msgs/Joy"),
            "the profile of test calls it body, but how it is stopped is not known (a joystick: "
            "base and arm are driven by it)");
  EXPECT_EQ(classOf(calling("body", {"*"}), "/twist_controller/command", kTwist), "endless motion")
      << "a zero does not stop an arm";
  EXPECT_EQ(classOf(calling("body", {"pan"}), "/pan", "my_msgs/Pan"), "other");
}

TEST(RobotTopics, ofAProfileAreNotShownIfTheyMove) {
  EXPECT_EQ(classOf(calling("shown", {"map_then"}), "/map_then", "nav_msgs/OccupancyGrid"),
            "shown");
  const RobotProfile robot = calling("shown", {"*"});
  EXPECT_EQ(classOf(robot, "/move_base/goal", "move_base_msgs/MoveBaseActionGoal"), "other");
  EXPECT_EQ(classOf(robot, "/cmd_vel", kTwist), "body");
  EXPECT_NE(RobotTopics(robot).refusal("/cmd_vel", kTwist), "");
}

TEST(RobotTopics, ofItsBaseAreNamedWhole) {
  RobotProfile robot;
  robot.base.velocity_topic = "/base/in";
  robot.base.take_over_topics = {"/pad"};
  robot.base.output_topic = "/base/out";
  robot.scan_topic = "/ranges";
  EXPECT_EQ(classOf(robot, "/base/in", kTwist), "body");
  EXPECT_EQ(classOf(robot, "/pad", kTwist), "control input");
  EXPECT_EQ(classOf(robot, "/robot1/pad", kTwist), "body") << "another one's";
  EXPECT_EQ(classOf(robot, "/base/out", kTwist), "other");
  EXPECT_EQ(classOf(robot, "/ranges", "sensor_msgs/LaserScan"), "other");
  robot.base.output_topic = robot.base.velocity_topic;
  EXPECT_EQ(classOf(robot, "/base/in", kTwist), "body") << "there is no multiplexer";
}

// ------------------------------------------------------------------- the README and the table

/// The lines of a section of replay/README.md.
std::vector<std::string> linesOf(const std::string& section) {
  std::ifstream file("replay/README.md");
  std::vector<std::string> lines;
  bool is_within = false;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("### ", 0) == 0) is_within = line == "### " + section;
    if (is_within) lines.push_back(line);
  }
  return lines;
}

/// The row of the README's table that begins with this class.
std::string rowOf(TopicClass topic_class) {
  const std::string begin = "| " + std::string(name(topic_class)) + " |";
  std::string row;
  for (const std::string& line : linesOf("What is published")) {
    if (line.rfind("Who named it", 0) == 0) break;  // permission_test holds the table behind it
    if (line.rfind(begin, 0) != 0) continue;
    EXPECT_EQ(row, "") << "twice: " << begin;
    row = line;
  }
  EXPECT_NE(row, "") << begin;
  return row;
}

struct Word {
  TopicClass topic_class;
  const char* in_readme;
  const char* topic;
  const char* type;
};

TEST(TopicTable, isWhatTheReadmeSays) {
  const std::vector<Word> words{
      {TopicClass::Body, "velocities", "/cmd_vel", kTwist},
      {TopicClass::Body, "trajectories", "/arm_controller/command",
       "trajectory_msgs/JointTrajectory"},
      {TopicClass::Body, "gripper", "/gripper_controller/gripper_action/goal",
       "control_msgs/GripperCommandActionGoal"},
      {TopicClass::Body, "head goals", "/head_controller/point_head/goal",
       "control_msgs/PointHeadActionGoal"},
      {TopicClass::Shown, "clouds", "/points", "sensor_msgs/PointCloud2"},
      {TopicClass::Shown, "scans", "/scan_then", "sensor_msgs/LaserScan"},
      {TopicClass::Shown, "paths", "/plan", "nav_msgs/Path"},
      {TopicClass::Shown, "markers", "/marks", "visualization_msgs/MarkerArray"},
      {TopicClass::Shown, "speech", "/robotsound", "sound_play/SoundRequest"},
      {TopicClass::Other, "tf", "/tf", "tf2_msgs/TFMessage"},
      {TopicClass::Other, "live sensors", "/base_scan", "sensor_msgs/LaserScan"},
      {TopicClass::Other, "answers", "/move_base/result", "move_base_msgs/MoveBaseActionResult"},
      {TopicClass::Other, "maps", "/map", "nav_msgs/OccupancyGrid"},
      {TopicClass::Other, "other actions", "/move_base/goal", "move_base_msgs/MoveBaseActionGoal"},
      {TopicClass::Other, "multiplexer", "/husky_velocity_controller/cmd_vel", kTwist},
      {TopicClass::Control, "Joy", "/joy", "sensor_msgs/Joy"},
      {TopicClass::Control, "/initialpose", "/initialpose",
       "geometry_msgs/PoseWithCovarianceStamped"},
      {TopicClass::Control, "runstops", "/enable_software_runstop", "std_msgs/Bool"},
      {TopicClass::Control, "a person's velocities", "/teleop/cmd_vel", kTwist},
      {TopicClass::Endless, "URScript", "/ur_hardware_interface/script_command",
       "std_msgs/String"},
      {TopicClass::Endless, "arm velocities", "/servo_server/delta_twist_cmds",
       "geometry_msgs/TwistStamped"},
      {TopicClass::Endless, "flying", "/mavros/setpoint_velocity/cmd_vel_unstamped", kTwist}};
  for (const Word& word : words) {
    EXPECT_NE(rowOf(word.topic_class).find(word.in_readme), std::string::npos) << word.in_readme;
    EXPECT_EQ(name(roleOf(word.topic, word.type).topic_class), name(word.topic_class))
        << word.topic;
  }
}

TEST(TopicTable, hasAStopForAllThatMovesTheBodyAndTheReadmeNamesIt) {
  const std::map<StopKind, std::string> words{{StopKind::Zero, "zeros"},
                                              {StopKind::Speed, "speed, acceleration and jerk 0"},
                                              {StopKind::NoPoints, "without points"},
                                              {StopKind::Cancel, "a cancel"},
                                              {StopKind::EndsItself, "it ends by itself"},
                                              {StopKind::IsStop, ""}};
  std::string readme;
  for (const std::string& line : linesOf("What stops each motion")) readme += line + "\n";
  for (const TopicRow& row : TopicTable::ofAllRobots().rows) {
    if (row.role.topic_class != TopicClass::Body) continue;
    ASSERT_EQ(words.count(row.role.stop), 1u) << row.role.why;
    EXPECT_NE(readme.find(words.at(row.role.stop)), std::string::npos) << row.role.why;
  }
}

TEST(TopicTable, saysWhyOfEachRow) {
  EXPECT_GT(TopicTable::ofAllRobots().rows.size(), 60u);
  for (const TopicRow& row : TopicTable::ofAllRobots().rows) {
    EXPECT_FALSE(row.role.why.empty());
    EXPECT_FALSE(row.names.empty() && row.types.empty()) << row.role.why << ": fits everything";
  }
}

}  // namespace
}  // namespace afterglow::replay::robot_topics_test
