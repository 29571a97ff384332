// projector_node's drift watch on a ROS graph: photographs of known tags, tf right and wrong.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include <fstream>
#include <memory>
#include <mutex>

#include "nodes/conversion/camera_messages.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_graph.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::nodes::drift_monitor_ros_test {
namespace {

using test::eventually;

/// The newest status of one name.
class Doctor {
 public:
  explicit Doctor(std::string name) : name_(std::move(name)) {
    diagnostics_ = nh_.subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 10, [this](const diagnostic_msgs::DiagnosticArrayConstPtr& message) {
          const std::lock_guard<std::mutex> lock(mutex_);
          for (const auto& status : message->status) {
            if (status.name == name_) {
              newest_ = std::to_string(int{status.level}) + " " + status.message;
            }
          }
        });
  }
  std::string newest() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return newest_;
  }
  bool says(const std::string& beginning) {
    return eventually([&] { return newest().rfind(beginning, 0) == 0; });
  }

 private:
  std::string name_;
  std::mutex mutex_;
  std::string newest_;
  ros::NodeHandle nh_;
  ros::Subscriber diagnostics_;
};

/// A board on the floor is the layout of known tags; the camera that sees it hangs in the room.
class DriftWatchTest : public test::RosGraph<test::GlTest> {
 protected:
  std::string writeConfig(const std::string& camera_info = "/camera/camera_info") {
    std::ofstream layout(folder_.path("floor.yaml"));
    layout << "frame: floor\ntags:\n";
    for (const calib::Tag& tag : rig_.board.tags) {
      layout << "  - {id: " << tag.id << ", corners: [";
      for (const auto& corner : tag.corners)
        layout << "[" << corner.x() << ", " << corner.y() << "],";
      layout << "]}\n";
    }
    std::ofstream(folder_.path("projector.yaml"))
        << "image_width: 640\nimage_height: 400\n"
           "camera_matrix: {rows: 3, cols: 3, data: [900, 0, 320, 0, 900, 400, 0, 0, 1]}\n"
           "distortion_coefficients: {rows: 1, cols: 0, data: []}\n";
    std::ofstream(folder_.path("config.yaml"))
        << "fixed_frame: map\n"
           "projector: {camera_info: projector.yaml, frame: projector_optical_frame}\n"
           "layers: [{topic: /marker, type: visualization_msgs/Marker}]\n"
           "watch: {image: /camera/image, camera_info: "
        << camera_info
        << ", tags: floor.yaml,"
           " period_s: 0.2, limit_mm: 10}\n";
    return folder_.path("config.yaml");
  }

  static geometry_msgs::TransformStamped inMap(const std::string& frame,
                                               const Eigen::Isometry3d& T_map_frame) {
    geometry_msgs::TransformStamped stamped;
    stamped.header.frame_id = "map";
    stamped.child_frame_id = frame;
    stamped.transform = toTransform(T_map_frame);
    return stamped;
  }
  /// The floor as tf believes it to be, off by so much.
  void publishTransforms(const ros::Publisher& publisher, double off_m) {
    Eigen::Isometry3d T_map_floor = pose_.matrix();
    T_map_floor.translate(Eigen::Vector3d(off_m, 0, 0));
    tf2_msgs::TFMessage message;
    message.transforms = {inMap("floor", T_map_floor),
                          inMap("camera_optical_frame", rig_.T_world_camera.matrix())};
    publisher.publish(message);
  }
  static sensor_msgs::Image imageOf(const calib::Picture& picture, const std::string& frame) {
    sensor_msgs::Image message;
    message.header.frame_id = frame;
    message.width = message.step = static_cast<std::uint32_t>(picture.width);
    message.height = static_cast<std::uint32_t>(picture.height);
    message.encoding = "mono8";
    message.data = picture.pixels;
    return message;
  }

  test::TempFolder folder_;
  test::SyntheticRig rig_ = test::makeRig(test::RigKind::Standard, 2);
  test::BoardPose pose_ = test::boardPoses(rig_, 1, 5).front();
};

TEST_F(DriftWatchTest, saysInDiagnosticsWhetherTagsLieWhereTfHasThem) {
  Doctor doctor("watching: drift watch");
  test::NodeProcess node({AFTERGLOW_TEST_PROJECTOR_NODE, "__name:=watching",
                          "_config:=" + writeConfig(), "_calibration:=" + folder_.path(""),
                          "_window:=false"});
  EXPECT_TRUE(doctor.says("3 nothing on /camera/image for 2 s")) << doctor.newest() << node.log();

  auto infos = nh_->advertise<sensor_msgs::CameraInfo>("/camera/camera_info", 1, true);
  infos.publish(toCameraInfo(rig_.camera));
  const calib::Picture gray = test::grayPicture(rig_.projector.width, rig_.projector.height);
  const auto photograph = imageOf(test::photograph(rig_, pose_, gray, 1), "camera_optical_frame");
  auto images = nh_->advertise<sensor_msgs::Image>("/camera/image", 1, true);
  images.publish(photograph);
  EXPECT_TRUE(
      doctor.says("3 no transform from 'floor' to the camera's frame"
                  " 'camera_optical_frame'"))
      << doctor.newest();

  const auto transforms = nh_->advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
  publishTransforms(transforms, 0);
  EXPECT_TRUE(doctor.says("0 " + std::to_string(rig_.board.tags.size()) + " tags within 0."))
      << doctor.newest();

  publishTransforms(transforms, 0.03);
  EXPECT_TRUE(doctor.says("1 drift: ")) << doctor.newest();
  const std::string drift = doctor.newest();
  EXPECT_TRUE(drift.find("30.") != std::string::npos || drift.find("29.") != std::string::npos)
      << drift;

  images.publish(
      imageOf(test::grayPicture(rig_.camera.width, rig_.camera.height), "camera_optical_frame"));
  EXPECT_TRUE(doctor.says("3 none of the ")) << doctor.newest();
  images.publish(imageOf(test::grayPicture(640, 480), "camera_optical_frame"));
  EXPECT_TRUE(doctor.says("3 /camera/image is of 640 x 480 pixels")) << doctor.newest();
  auto strange = photograph;
  strange.encoding = "yuv422";
  images.publish(strange);
  EXPECT_TRUE(eventually([&] { return doctor.newest().find("yuv422") != std::string::npos; }))
      << doctor.newest();
  images.publish(photograph);
  publishTransforms(transforms, 0);
  EXPECT_TRUE(doctor.says("0 ")) << "recovers: " << doctor.newest();
  node.interrupt();
  EXPECT_EQ(node.exitStatus(), 0);
}

/// As roslaunch gives it: the path of the configuration is absolute, and with it the camera's.
TEST_F(DriftWatchTest, readsTheCamerasLensFromAFileBesideTheConfiguration) {
  const std::string config = writeConfig("camera.yaml");
  const sensor_msgs::CameraInfo info = toCameraInfo(rig_.camera);
  std::ofstream(folder_.path("camera.yaml"))
      << fmt::format("{{width: {}, height: {}, distortion_model: {}, D: [{}], K: [{}]}}",
                     info.width, info.height, info.distortion_model, fmt::join(info.D, ", "),
                     fmt::join(info.K, ", "));
  auto images = nh_->advertise<sensor_msgs::Image>("/camera/image", 1, true);
  const calib::Picture gray = test::grayPicture(rig_.projector.width, rig_.projector.height);
  images.publish(imageOf(test::photograph(rig_, pose_, gray, 1), "camera_optical_frame"));
  const auto transforms = nh_->advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
  publishTransforms(transforms, 0);
  Doctor doctor("watching: drift watch");
  test::NodeProcess node({AFTERGLOW_TEST_PROJECTOR_NODE, "__name:=watching", "_config:=" + config,
                          "_calibration:=" + folder_.path(""), "_window:=false"});
  EXPECT_TRUE(doctor.says("0 " + std::to_string(rig_.board.tags.size()) + " tags within 0."))
      << doctor.newest() << node.log();
  node.interrupt();
  EXPECT_EQ(node.exitStatus(), 0);
}

}  // namespace
}  // namespace afterglow::nodes::drift_monitor_ros_test
