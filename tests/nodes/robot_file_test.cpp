// Robots' profiles: the one that is built in, and what is refused in a file.
#include "nodes/player/robot_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>

#include "nodes/player/play_options.hpp"
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
  EXPECT_EQ(fetch.joint_speeds.at("elbow_flex_joint"), 1.521);
  EXPECT_EQ(fetch.gripper_joints.size(), 2u);
  EXPECT_EQ(fetch.gaze_frame, "head_tilt_link");
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
            "robot.yaml:2: 'scan' should be a topic, /NAME");
  EXPECT_EQ(fault("name: a\nbase:\n  footprint: [[0, 1], [1, 0]]\n"),
            "robot.yaml:3: 'footprint' should be a list of at least 3 corners, [x, y] in m");
  EXPECT_EQ(fault("name: a\njoints: {elbow: {sped: 1}}\n"),
            "robot.yaml:2: unknown key 'sped' in joint elbow; did you mean 'speed'?");
  const std::string stop = fault("name: a\nemergency_stop: {topic: /stop, stops_when: maybe}\n");
  EXPECT_EQ(stop.find("robot.yaml:2: unknown stops_when 'maybe' in emergency_stop"), 0u) << stop;
}

TEST_F(RobotFileTest, aRobotInANamespaceHasItsTopicsThere) {
  const replay::RobotProfile fetch = inNamespace(findRobotProfile("fetch"), "/fetch7");
  EXPECT_EQ(fetch.base.velocity_topic, "/fetch7/cmd_vel");
  EXPECT_EQ(fetch.base.take_over_topics, std::vector<std::string>{"/fetch7/teleop/cmd_vel"});
  EXPECT_EQ(fetch.base.output_topic, "/fetch7/base_controller/command");
  EXPECT_EQ(fetch.base.odometry_topic, "/fetch7/odom");
  EXPECT_EQ(fetch.scan_topic, "/fetch7/base_scan");
  EXPECT_EQ(fetch.emergency_stop.topic, "/fetch7/robot_state");
  EXPECT_EQ(fetch.base.base_frame, "base_link");
  EXPECT_EQ(inNamespace(findRobotProfile("fetch"), "/").scan_topic, "/base_scan");
  EXPECT_EQ(inNamespace({}, "/fetch7").scan_topic, "") << "what is not known stays so";
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
  EXPECT_EQ(request.robot.name, "mine");
  EXPECT_EQ(request.body.robot.name, "mine");
  EXPECT_EQ(request.body.base.frames.base, "base_footprint");
  EXPECT_EQ(request.body.base.frames.odometry, "odom_combined");
  EXPECT_EQ(request.body.base.frames.map, "map");
}

}  // namespace
}  // namespace afterglow::nodes::robot_file_test
