// `afterglow calibrate mount` as a user meets it.
#include <tf2_msgs/TFMessage.h>
#include <yaml-cpp/yaml.h>

#include <nlohmann/json.hpp>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/verbs/verb_node.hpp"
#include "tests/support/calibrate_command.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"

namespace afterglow::nodes::calibrate_mount_ros_test {
namespace {

class MountCommand : public test::CalibrateCommand {
 protected:
  /// A calibration whose projector stands at x in the camera's frame, looking where it looks.
  std::string calibration(const std::string& name, double x) const {
    write(name + "/T_camera_projector.yaml",
          "parent_frame: camera_optical_frame\nchild_frame: projector_optical_frame\n"
          "T_camera_projector:\n  - [1, 0, 0, " +
              std::to_string(x) + "]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n");
    return path(name);
  }
};

TEST_F(MountCommand, writesTheStaticTransform) {
  // The camera a meter up in the link, looking along x.
  const ProgramResult result =
      calibrate({"mount", "--calibration", calibration("one", 0.25), "--link", "torso",
                 "--camera-tf", "0,0,1,-0.5,0.5,-0.5,0.5", "--out", path("out")});
  ASSERT_EQ(result.status, 0) << result.output;
  EXPECT_NE(result.output.find("from one pose"), std::string::npos) << result.output;
  const YAML::Node yaml = YAML::LoadFile(path("out/static_transform.yaml"));
  EXPECT_EQ(yaml["parent_frame"].as<std::string>(), "torso");
  // The camera's x is the link's -y.
  EXPECT_NEAR(yaml["translation"]["x"].as<double>(), 0, 1e-9);
  EXPECT_NEAR(yaml["translation"]["y"].as<double>(), -0.25, 1e-9);
  EXPECT_NEAR(yaml["translation"]["z"].as<double>(), 1, 1e-9);
  EXPECT_NEAR(yaml["rotation"]["w"].as<double>(), 0.5, 1e-9);
  EXPECT_NEAR(yaml["rotation"]["x"].as<double>(), -0.5, 1e-9);
  std::ifstream launch(path("out/projector_tf.launch"));
  const std::string text(std::istreambuf_iterator<char>(launch), {});
  EXPECT_NE(text.find(" torso projector_optical_frame\""), std::string::npos) << text;
}

TEST_F(MountCommand, averagesPosesAndLeavesOutTheOddOne) {
  std::string poses = "poses:\n";
  const double wrong[] = {0, 0.001, -0.001, 0.05};
  for (int i = 0; i < 4; ++i) {
    calibration("pose" + std::to_string(i), 0.1 + wrong[i]);
    poses += "  - {name: turn" + std::to_string(i) + ", calibration: pose" + std::to_string(i) +
             ", camera_tf: [0, 0, 0, 0, 0, 0, 1]}\n";
  }
  write("poses.yaml", poses);
  const ProgramResult result = calibrate(
      {"mount", "--poses", path("poses.yaml"), "--link", "turret", "--out", path("out"), "--json"});
  ASSERT_EQ(result.status, 0) << result.output;
  EXPECT_NE(result.output.find("left out turn3: 50.0 mm"), std::string::npos) << result.output;
  const auto json = nlohmann::json::parse(result.output.substr(result.output.find('{')));
  EXPECT_NEAR(json["translation"][0].get<double>(), 0.1, 1e-9);
  EXPECT_FALSE(json["poses"][3]["used"].get<bool>());
  EXPECT_NEAR(json["spread_mm"].get<double>(), std::sqrt(2.0 / 3), 1e-6);

  write("poses.yaml",
        poses.substr(0, poses.find("  - {name: turn2")) +
            "  - {name: far, calibration: pose3, camera_tf: [1, 0, 0, 0, 0, 0, 1]}\n"
            "  - {name: farther, calibration: pose3, camera_tf: [2, 0, 0, 0, 0, 0, 1]}\n");
  expectRefused({"mount", "--poses", path("poses.yaml"), "--link", "turret", "--out", path("out")},
                "the poses contradict each other");
  write("poses.yaml", "poses:\n  - {calibration: pose0, camera_ft: [0, 0, 0, 0, 0, 0, 1]}\n");
  expectRefused({"mount", "--poses", path("poses.yaml"), "--link", "turret", "--out", path("out")},
                "poses.yaml:2: unknown key 'camera_ft' in pose 1; did you mean 'camera_tf'?");
  write("poses.yaml", "poses:\n  - {calibration: pose0, camera_tf: [0, 0, 0, 1, 0, 0, 1]}\n");
  expectRefused({"mount", "--poses", path("poses.yaml"), "--link", "turret", "--out", path("out")},
                "poses.yaml:2: 'camera_tf' of pose 1: the quaternion qx qy qz qw has length 1.414");
}

TEST_F(MountCommand, collectsPosesOneByOne) {
  for (int i = 0; i < 3; ++i) {
    const ProgramResult result = calibrate(
        {"mount", "--calibration", calibration("turn" + std::to_string(i), 0.1 + 0.001 * i),
         "--camera-tf", "0,0,0,0,0,0,1", "--link", "turret", "--add-to", path("poses.yaml"),
         "--out", path("out")});
    ASSERT_EQ(result.status, 0) << result.output;
  }
  const YAML::Node yaml = YAML::LoadFile(path("out/static_transform.yaml"));
  EXPECT_EQ(yaml["poses"].size(), 3u);
  EXPECT_NEAR(yaml["translation"]["x"].as<double>(), 0.101, 1e-9);
}

TEST_F(MountCommand, asksTheRunningRobot) {
  const test::RosMaster master;
  int argc = 0;
  ros::init(argc, nullptr, "calibrate_test", ros::init_options::NoSigintHandler);
  {
    ros::NodeHandle nh;
    auto publisher = nh.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
    tf2_msgs::TFMessage message;
    message.transforms.resize(1);
    message.transforms[0].header.frame_id = "turret_link";
    message.transforms[0].child_frame_id = "camera_optical_frame";
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = Eigen::Vector3d(0.5, 0, 0.2);
    message.transforms[0].transform = toTransform(T);
    publisher.publish(message);
    const ProgramResult result = calibrate({"mount", "--calibration", calibration("one", 0.25),
                                            "--from-tf", "turret_link", "--out", path("out")});
    ASSERT_EQ(result.status, 0) << result.output;
    const YAML::Node yaml = YAML::LoadFile(path("out/static_transform.yaml"));
    EXPECT_EQ(yaml["parent_frame"].as<std::string>(), "turret_link");
    EXPECT_NEAR(yaml["translation"]["x"].as<double>(), 0.75, 1e-9);
    EXPECT_NEAR(yaml["translation"]["z"].as<double>(), 0.2, 1e-9);
  }
  {
    // And the other way: what the launch file starts where tf2_ros has no program for it.
    test::NodeProcess node({AFTERGLOW_TEST_STATIC_TRANSFORM_NODE, "0.1", "-0.2", "0.3", "-0.5",
                            "0.5", "-0.5", "0.5", "turret_link", "projector"});
    const Eigen::Isometry3d T = askTransform("turret_link", "projector", 20);
    EXPECT_LT((T.translation() - Eigen::Vector3d(0.1, -0.2, 0.3)).norm(), 1e-12);
    EXPECT_LT((T.linear() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-9);
    node.interrupt();
    EXPECT_EQ(node.exitStatus(), 0);
    const ProgramResult wrong = runProgram({AFTERGLOW_TEST_STATIC_TRANSFORM_NODE, "0.1", "a", "b"});
    EXPECT_EQ(wrong.status, 2);
    EXPECT_EQ(wrong.output,
              "static_transform_node: expected: x y z qx qy qz qw parent_frame "
              "child_frame\n");
  }
  ros::shutdown();
  setenv("ROS_MASTER_URI", "http://localhost:1", 1);
  expectRefused({"mount", "--calibration", path("one"), "--from-tf", "x", "--out", path("out")},
                "no ROS master answers at http://localhost:1");
}

TEST_F(MountCommand, endsWithTwoForWrongUsage) {
  const std::string tf = "0,0,0,0,0,0,1";
  expectWrongUsage({"mount", "--out", "x"});
  expectWrongUsage({"mount", "--calibration", "c", "--link", "l", "--out", "x"});
  expectWrongUsage({"mount", "--calibration", "c", "--camera-tf", tf, "--out", "x"});
  expectWrongUsage(
      {"mount", "--calibration", "c", "--link", "l", "--camera-tf", "0,0,0", "--out", "x"});
  expectWrongUsage({"mount", "--poses", "p", "--calibration", "c", "--link", "l", "--out", "x"});
}

}  // namespace
}  // namespace afterglow::nodes::calibrate_mount_ros_test
