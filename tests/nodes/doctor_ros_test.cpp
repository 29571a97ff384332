// `afterglow doctor` and `init` beside a robot that runs.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "nodes/projector/projector_config.hpp"
#include "nodes/tools/program.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::doctor_ros_test {
namespace {

class DoctorBesideARobot : public testing::Test {
 protected:
  static void SetUpTestSuite() { graph = new test::TestGraph; }
  static void TearDownTestSuite() {
    ros::shutdown();
    delete graph;
  }
  DoctorBesideARobot() {
    node_.setParam("/robot_description", test::fileBytes("assets/fetch.urdf"));
    robot_ = std::make_unique<test::NodeProcess>(
        std::vector<std::string>{AFTERGLOW_TEST_FAKE_FETCH_NODE});
    test::eventually([] {
      return askMaster(deadlineIn(2)).publishers.count("/base_scan") > 0;
    });
  }
  ~DoctorBesideARobot() override {
    if (robot_->pid() < 0) return;
    robot_->interrupt();
    robot_->exitStatus();
  }

  /// Level by check.
  std::map<std::string, std::string> levels() const {
    const ProgramResult result =
        runProgram({"/bin/sh", "-c", std::string(AFTERGLOW_TEST_COMMAND) +
                                         " doctor --robot fetch --json --store '" +
                                         folder_.path("store.db") + "' 2>/dev/null"});
    const auto json = nlohmann::json::parse(result.output);
    EXPECT_EQ(result.status, json["ok"].get<bool>() ? 0 : 1);
    std::map<std::string, std::string> levels;
    for (const auto& check : json["checks"]) levels[check["name"]] = check["level"];
    return levels;
  }

  static test::TestGraph* graph;
  ros::NodeHandle node_;
  test::TempFolder folder_;
  std::unique_ptr<test::NodeProcess> robot_;
};
test::TestGraph* DoctorBesideARobot::graph = nullptr;

TEST_F(DoctorBesideARobot, findsWhatTheProfileNamesAndMissesItWhenTheRobotIsGone) {
  auto with = levels();
  for (const char* name : {"master", "controllers", "joints", "description", "base", "odometry",
                           "frames", "scan", "emergency stop"}) {
    EXPECT_EQ(with[name], "ok") << name;
  }
  EXPECT_EQ(with["guard"], "advice");
  robot_->interrupt();
  robot_->exitStatus();
  auto without = levels();
  for (const char* name : {"controllers", "joints", "base", "frames", "scan", "emergency stop"}) {
    EXPECT_EQ(without[name], "problem") << name;
  }
  EXPECT_EQ(without["store"], "ok");
}

TEST_F(DoctorBesideARobot, hearsABridgeToRos2) {
  diagnostic_msgs::DiagnosticArray array;
  array.status.resize(2);
  array.status[0].name = "ros2_bridge_node";
  array.status[0].hardware_id = "ros2_bridge";
  array.status[1].name = "motors";
  ros::Publisher publisher =
      node_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 1, true);
  publisher.publish(array);
  auto with = levels();
  EXPECT_EQ(with["bridge to ROS 2"], "ok");
  EXPECT_EQ(with.count("motors"), 0u);
}

TEST_F(DoctorBesideARobot, writesFilesThatProjectorAndRoslaunchUnderstand) {
  const std::string out = folder_.path("mine");
  const std::vector<std::string> init = {AFTERGLOW_TEST_COMMAND, "init", "--robot", "fetch",
                                         "--out", out, "--store", folder_.path("s.db")};
  const ProgramResult written = runProgram(init);
  EXPECT_EQ(written.status, 0) << written.output;
  const ProjectorConfig config = loadProjectorConfig(out + "/projector.yaml", out + "/calibration");
  EXPECT_EQ(config.fixed_frame, "map");
  ASSERT_EQ(config.layers.size(), 1u);
  EXPECT_EQ(config.layers[0].topic, "/base_scan");

  setenv("ROS_PACKAGE_PATH", ".", 1);
  const ProgramResult launch = runProgram({"roslaunch", "--nodes", out + "/robot.launch"});
  EXPECT_EQ(launch.status, 0) << launch.output;
  for (const char* node : {"/projector_node", "/recorder_node", "/player_node", "/speaker_node"}) {
    EXPECT_NE(launch.output.find(node), std::string::npos) << node << " in " << launch.output;
  }
  const std::string before = test::fileBytes(out + "/projector.yaml");
  const ProgramResult again = runProgram(init);
  EXPECT_EQ(again.status, 1);
  EXPECT_EQ(again.output, "afterglow init: " + out + ": the folder is not empty, and stays as it "
                                                      "is\n");
  EXPECT_EQ(test::fileBytes(out + "/projector.yaml"), before);
}

}  // namespace
}  // namespace afterglow::nodes::doctor_ros_test
