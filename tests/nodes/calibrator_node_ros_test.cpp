#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <std_srvs/Trigger.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/camera_info_file.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/targets/target_files.hpp"
#include "nodes/console/http_message.hpp"
#include "nodes/console/robot_links.hpp"
#include "tests/support/calibration_room.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_graph.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::nodes::calibrator_node_ros_test {
namespace {

using test::eventually;

const std::string kProgram = AFTERGLOW_TEST_CALIBRATOR_NODE;
constexpr int kViews = 5;

class CalibratorNodeTest : public test::RosGraph<testing::Test> {
 protected:
  void SetUp() override {
    calib::writeBoard(folder_.path("targets"), rig_.board);
    calib::writePattern(folder_.path("targets"), rig_.pattern);
  }

  std::vector<std::string> command(const std::string& name) const {
    return {kProgram,
            "__name:=" + name,
            "_board_file:=" + folder_.path("targets/board.yaml"),
            "_pattern_file:=" + folder_.path("targets/pattern.yaml"),
            "_out:=" + folder_.path("out"),
            "_image_topic:=/room/image_raw",
            "_window:=false",
            "_views:=" + std::to_string(kViews),
            "_coverage:=0.2",
            "_still_seconds:=0.3",
            "_settle_frames:=1",
            "_publish_transform:=true"};
  }
  static std_srvs::Trigger call(const std::string& service) {
    std_srvs::Trigger trigger;
    if (!ros::service::waitForService(service, ros::Duration(20)) ||
        !ros::service::call(service, trigger)) {
      throw std::runtime_error("no answer from " + service);  // the rest would wait in vain
    }
    return trigger;
  }

  const test::SyntheticRig rig_ = test::makeRig(test::RigKind::Standard, 3, 512);
  test::TempFolder folder_;
};

TEST_F(CalibratorNodeTest, calibratesAProjectorThroughALaggingCamera) {
  test::CalibrationRoom room(rig_, "guided");
  std::mutex mutex;
  std::optional<geometry_msgs::TransformStamped> transform;
  std::optional<sensor_msgs::CameraInfo> info;
  const auto transforms = nh_->subscribe<tf2_msgs::TFMessage>(
      "/tf_static", 1, [&](const tf2_msgs::TFMessageConstPtr& message) {
        const std::lock_guard<std::mutex> lock(mutex);
        transform = message->transforms.front();
      });
  const auto infos = nh_->subscribe<sensor_msgs::CameraInfo>(
      "/guided/camera_info", 1, [&](const sensor_msgs::CameraInfoConstPtr& message) {
        const std::lock_guard<std::mutex> lock(mutex);
        info = *message;
      });
  const CalibratorLink console("/guided");
  EXPECT_TRUE(console.state().is_null());
  test::NodeProcess node(command("guided"));
  ASSERT_TRUE(room.isPhase("done")) << room.status() << "\n" << room.said() << node.log();

  const auto estimate = calib::loadCalibration(folder_.path("out"));
  // Five views by a camera of a sixth of the usual pixels.
  EXPECT_LT(test::errorP95_mm(rig_, estimate), 0.5);
  EXPECT_LT(room.status().at("held_out_mm"), 1.0);
  EXPECT_LT(room.status().at("check_mm"), 1.0);
  for (const char* file :
       {"views/view_00.png", "views/view_00_plain.png", "views/view_04.png", "report.html",
        "calibration.yaml", "T_camera_projector.yaml", "verification.yaml", "check/view_00.png"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_.path("out/") + file)) << file;
  }
  EXPECT_EQ(calib::loadCameraInfo(folder_.path("out/camera_info.yaml")).lens.K, rig_.camera.K);
  EXPECT_NE(room.said().find("view taken: 5 of 5 views, coverage "), std::string::npos);
  // The room's camera has images without noise, and stamps of its own.
  EXPECT_NE(room.said().find("the projector's delay is not measured: "), std::string::npos)
      << room.said();
  // What a page shows.
  ASSERT_TRUE(eventually([&] { return console.state().value("phase", "") == "done"; }));
  const nlohmann::ordered_json shown = console.state();
  EXPECT_EQ(shown.at("held_out_mm").get<double>(), room.status().at("held_out_mm").get<double>());
  EXPECT_NE(shown.at("said").dump().find("checked: the light is "), std::string::npos);
  const std::string lit = shown.at("lit").dump();
  EXPECT_EQ(shown.at("lit").size(), 10u);
  EXPECT_GT(std::count(lit.begin(), lit.end(), '#'), 160 * shown.at("coverage").get<double>() / 2);
  EXPECT_NE(room.spoken().find("checked: the light is "), std::string::npos) << room.spoken();
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return transform && info;
  }));
  const std::lock_guard<std::mutex> lock(mutex);
  ASSERT_TRUE(transform && info);
  EXPECT_EQ(transform->header.frame_id, "room_camera");
  EXPECT_EQ(transform->child_frame_id, "projector_optical_frame");
  EXPECT_NEAR(transform->transform.translation.x,
              estimate.T_camera_projector.matrix().translation().x(), 1e-9);
  EXPECT_EQ(info->K[5], estimate.projector.K(1, 2));
  node.interrupt();
  EXPECT_EQ(node.exitStatus(), 0);
  EXPECT_TRUE(eventually([&] { return room.isBlack(); }));
}

TEST_F(CalibratorNodeTest, refusesTooFewViewsAndGoesOn) {
  test::CalibrationRoom room(rig_, "few");
  room.holdStill();
  test::NodeProcess node(command("few"));
  ASSERT_TRUE(room.hasViews(1)) << room.said() << node.log();
  EXPECT_TRUE(call("/few/discard_last").response.success);
  EXPECT_TRUE(room.hasViews(0));
  ASSERT_TRUE(room.hasViews(1)) << room.said();  // nothing is like it any more
  EXPECT_TRUE(call("/few/take").response.success);
  ASSERT_TRUE(room.hasViews(2)) << room.said();
  EXPECT_TRUE(call("/few/solve").response.success);
  EXPECT_TRUE(eventually([&] {
    return room.said().find("cannot calibrate yet: ") != std::string::npos;
  })) << room.said()
      << node.log();
  EXPECT_TRUE(room.isPhase("collecting"));
  EXPECT_TRUE(call("/few/stop").response.success);
  EXPECT_FALSE(call("/few/stop").response.success);
  EXPECT_THROW(CalibratorLink("/few").trigger("stop"), HttpError);
  EXPECT_FALSE(call("/few/take").response.success);
  EXPECT_TRUE(eventually([&] { return room.isBlack(); }));
  EXPECT_TRUE(call("/few/start").response.success);
  EXPECT_TRUE(room.hasViews(0));
  EXPECT_FALSE(std::filesystem::exists(folder_.path("out/projector.yaml")));
}

TEST_F(CalibratorNodeTest, saysWhatIsWrongWithTheCamera) {
  test::CalibrationRoom room(rig_, "wrong");
  room.setEncoding("mono16");
  test::NodeProcess node(command("wrong"));
  const auto isProblem = [&](const std::string& text) {
    return eventually(
        [&] { return room.status().value("problem", "").find(text) != std::string::npos; });
  };
  EXPECT_TRUE(isProblem("/room/image_raw: image encoding 'mono16' has 16 bits"));
  room.setEncoding("mono8");
  ASSERT_TRUE(room.isPhase("collecting")) << node.log();
  EXPECT_TRUE(eventually([&] { return room.status().value("problem", "?").empty(); }));
  room.stopCamera();
  EXPECT_TRUE(isProblem("the camera has stopped: nothing on /room/image_raw for 3 s"));
  EXPECT_NE(room.said().find("the camera has stopped"), std::string::npos);
  node.interrupt();
  EXPECT_EQ(node.exitStatus(), 0);
}

TEST_F(CalibratorNodeTest, namesTheParameterThatIsWrong) {
  const auto failsWith = [&](const std::string& argument, const std::string& text) {
    auto arguments = command("refused");
    arguments.push_back(argument);
    test::NodeProcess node(arguments);
    EXPECT_EQ(node.exitStatus(), 1);
    EXPECT_NE(node.log().find(text), std::string::npos) << node.log();
  };
  failsWith("_views:=0", "parameter ~views should be from 3 to 1000");
  failsWith("_board_file:=/no/such/board.yaml", "/no/such/board.yaml");
  failsWith("_coverage:=lots", "parameter ~coverage has a value of the wrong type");
}

}  // namespace
}  // namespace afterglow::nodes::calibrator_node_ros_test
