// `afterglow calibrate mount` and `verify` as a user meets them.
#include <gtest/gtest.h>
#include <tf2_msgs/TFMessage.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/report/calibration_files.hpp"
#include "calib/targets/target_files.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/program.hpp"
#include "nodes/tools/transform_question.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

class CalibrateCommand : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path(name); }
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories(fs::path(path(name)).parent_path());
    std::ofstream(path(name)) << text;
  }
  ProgramResult calibrate(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {AFTERGLOW_TEST_COMMAND, "calibrate"});
    return runProgram(arguments);
  }
  /// Status 1 and one line that holds this.
  void expectRefused(const std::vector<std::string>& arguments, const std::string& text) const {
    const ProgramResult result = calibrate(arguments);
    EXPECT_EQ(result.status, 1) << result.output;
    EXPECT_NE(result.output.find(text), std::string::npos) << result.output;
    EXPECT_EQ(result.output.find('\n'), result.output.size() - 1) << result.output;
  }
  /// A calibration whose projector stands at x in the camera's frame, looking where it looks.
  std::string calibration(const std::string& name, double x) const {
    write(name + "/T_camera_projector.yaml",
          "parent_frame: camera_optical_frame\nchild_frame: projector_optical_frame\n"
          "T_camera_projector:\n  - [1, 0, 0, " +
              std::to_string(x) + "]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n");
    return path(name);
  }
  test::TempFolder folder_;
};

// ------------------------------------------------------------------------------------------ mount

TEST_F(CalibrateCommand, mountWritesTheStaticTransform) {
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

TEST_F(CalibrateCommand, mountAveragesPosesAndLeavesOutTheOddOne) {
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

TEST_F(CalibrateCommand, mountCollectsPosesOneByOne) {
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

TEST_F(CalibrateCommand, mountAsksTheRunningRobot) {
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
                "no ROS master at http://localhost:1");
}

// ----------------------------------------------------------------------------------------- verify

/// A finished calibration on disk, and what else verify asks for.
class VerifyCommand : public CalibrateCommand {
 protected:
  VerifyCommand() {
    calib::writeBoard(path("board"), rig_.board);
    calib::writePattern(path("pattern"), rig_.pattern);
    save("good", 0);
    save("bad", 2);
    write("camera.yaml", infoText(rig_.camera));
  }
  void save(const std::string& name, double shift_px) const {
    calib::Calibration calibration;
    calibration.estimate = rig_.truth();
    calibration.estimate.projector.K(0, 2) += shift_px;
    calibration.camera = rig_.camera;
    calib::saveCalibration(path(name), calibration, {}, "2026-11-21T04:30:00Z");
  }
  static std::string infoText(const calib::Lens& lens) {
    std::ostringstream text;
    text.precision(17);
    text << "image_width: " << lens.width << "\nimage_height: " << lens.height
         << "\ncamera_matrix: {rows: 3, cols: 3, data: [";
    for (int i = 0; i < 9; ++i) text << (i == 0 ? "" : ", ") << lens.K(i / 3, i % 3);
    text << "]}\ndistortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [";
    for (std::size_t i = 0; i < 5; ++i) text << (i == 0 ? "" : ", ") << lens.D[i];
    text << "]}\n";
    return text.str();
  }
  std::vector<std::string> views(const std::string& calibration) const {
    return {"verify",
            "--images",
            path("views"),
            "--board",
            path("board/board.yaml"),
            "--pattern",
            path("pattern/pattern.yaml"),
            "--camera",
            path("camera.yaml"),
            "--calibration",
            path(calibration)};
  }
  test::SyntheticRig rig_ = test::makeRig(test::RigKind::Standard, 1);
};

TEST_F(VerifyCommand, measuresFreshViewsOfTheBoard) {
  const auto pose = test::boardPoses(rig_, 1, 4).front();
  const calib::Photographs shot = test::Photographer(rig_).photographs("view_00", pose, 1);
  fs::create_directories(path("views"));
  expectRefused(views("good"), "views: no photographs: expected view_00.png");
  calib::savePicture(path("views/view_00_plain.png"), *shot.plain);
  expectRefused(views("good"), "there is no view_00.png of the pattern to it");
  calib::savePicture(path("views/view_00.png"), shot.pattern);

  auto arguments = views("good");
  arguments.insert(arguments.end(), {"--json", "--max-p95-mm", "0.5"});
  const ProgramResult good = calibrate(arguments);
  ASSERT_EQ(good.status, 0) << good.output;
  const auto json = nlohmann::json::parse(good.output);
  EXPECT_EQ(json["method"], "views");
  EXPECT_LT(json["p95_mm"].get<double>(), 0.5);
  EXPECT_EQ(json["views"][0]["name"], "view_00");
  EXPECT_GT(json["views"][0]["corners"].get<int>(), 40);

  arguments = views("bad");
  arguments.insert(arguments.end(), {"--max-p95-mm", "0.5"});
  const ProgramResult bad = calibrate(arguments);
  EXPECT_EQ(bad.status, 1);
  EXPECT_NE(bad.output.find("view_00"), std::string::npos) << bad.output;
  EXPECT_NE(bad.output.find("more than the 0.50 mm allowed by --max-p95-mm"), std::string::npos)
      << bad.output;
}

TEST_F(VerifyCommand, plansAThrowAndMeasuresIt) {
  std::string layout = "tags:\n";
  for (const calib::Tag& tag : rig_.board.tags) {
    std::ostringstream entry;
    entry << "  - {id: " << tag.id << ", corners: [";
    for (const auto& corner : tag.corners) entry << "[" << corner.x() << ", " << corner.y() << "],";
    layout += entry.str() + "]}\n";
  }
  const std::string targets = "targets:\n  - {id: 120, center: [0, 0], size: 0.11}\n";
  write("floor.yaml", layout + targets);
  const auto pose = test::boardPoses(rig_, 1, 4).front();
  const test::Photographer photographer(rig_);
  calib::savePicture(path("plain.png"),
                     photographer.photograph(
                         pose, test::greyPicture(rig_.projector.width, rig_.projector.height), 1));
  const ProgramResult plan = calibrate(
      {"verify", "--plan", "--targets", path("floor.yaml"), "--photograph", path("plain.png"),
       "--camera", path("camera.yaml"), "--calibration", path("good"), "--out", path("throw.png")});
  ASSERT_EQ(plan.status, 0) << plan.output;
  calib::savePicture(path("lit.png"),
                     photographer.photograph(pose, calib::loadPicture(path("throw.png")), 2));
  const std::vector<std::string> measure = {
      "verify",       "--thrown",        path("lit.png"), "--targets",        path("floor.yaml"),
      "--photograph", path("plain.png"), "--camera",      path("camera.yaml")};
  auto arguments = measure;
  arguments.insert(arguments.end(), {"--json", "--out", path("errors.png"), "--max-p95-mm", "0.5"});
  const ProgramResult result = calibrate(arguments);
  ASSERT_EQ(result.status, 0) << result.output;
  const auto json = nlohmann::json::parse(result.output);
  EXPECT_EQ(json["method"], "targets");
  EXPECT_EQ(json["targets"][0]["id"], 120);
  EXPECT_LT(json["targets"][0]["error_mm"].get<double>(), 0.5);
  EXPECT_TRUE(fs::exists(path("errors.png")));
  EXPECT_NE(calibrate(measure).output.find("median"), std::string::npos);
  write("more.yaml", layout + targets + "  - {id: 121, center: [0.15, 0], size: 0.08}\n");
  arguments = measure;
  arguments[4] = path("more.yaml");
  EXPECT_EQ(calibrate(arguments).status, 0) << "says so, but nobody asked for a judgment";
  arguments.insert(arguments.end(), {"--max-p95-mm", "0.5"});
  const ProgramResult fewer = calibrate(arguments);
  EXPECT_EQ(fewer.status, 1);
  EXPECT_NE(fewer.output.find("1 of the 2 targets not seen"), std::string::npos) << fewer.output;
  arguments = measure;
  arguments[2] = path("plain.png");
  const ProgramResult nothing = calibrate(arguments);
  EXPECT_EQ(nothing.status, 1);
  EXPECT_NE(nothing.output.find("none of the 1 targets is seen"), std::string::npos)
      << nothing.output;
}

TEST_F(CalibrateCommand, endsWithTwoForWrongUsage) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"mount", "--out", "x"},
           {"mount", "--calibration", "c", "--link", "l", "--out", "x"},
           {"mount", "--calibration", "c", "--camera-tf", "0,0,0,0,0,0,1", "--out", "x"},
           {"mount", "--calibration", "c", "--link", "l", "--camera-tf", "0,0,0", "--out", "x"},
           {"mount", "--poses", "p", "--calibration", "c", "--link", "l", "--out", "x"},
           {"verify", "--camera", "c"},
           {"verify", "--camera", "c", "--images", "i"},
           {"verify", "--camera", "c", "--plan", "--thrown", "t"},
           {"verify", "--camera", "c", "--plan", "--targets", "t"},
           {"verify", "--camera", "c", "--thrown", "t", "--targets", "t", "--board", "b"}}) {
    const ProgramResult result = calibrate(arguments);
    EXPECT_EQ(result.status, 2) << result.output;
  }
}

}  // namespace
}  // namespace afterglow::nodes
