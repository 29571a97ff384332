#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>
#include <sensor_msgs/Image.h>
#include <std_srvs/Trigger.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/Marker.h>

#include <atomic>
#include <fstream>
#include <mutex>
#include <string>

#include "nodes/conversion/geometry_conversion.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_graph.hpp"
#include "tests/support/table_cloud.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::find_surfaces_ros_test {
namespace {

using test::eventually;

const char kLens[] =
    "image_width: 320\nimage_height: 240\ncamera_name: projector\n"
    "camera_matrix: {rows: 3, cols: 3, data: [250, 0, 160, 0, 250, 120, 0, 0, 1]}\n"
    "distortion_model: plumb_bob\n"
    "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"
    "rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
    "projection_matrix: {rows: 3, cols: 4, data: [250, 0, 160, 0, 0, 250, 120, 0, 0, 0, 1, 0]}\n";
const char kConfig[] =
    "fixed_frame: map\n"
    "projector: {camera_info: projector.yaml, frame: projector}\n"
    "surfaces:\n"
    "  table: {frame: map, find_in: /depth, height: [0.5, 1.0], relief: {from: /depth}}\n"
    "layers:\n"
    "  - {topic: /marker, type: visualization_msgs/Marker, placement: drape, surface: table}\n";

class FindSurfaces : public test::RosGraph<test::GlTest> {
 protected:
  void SetUp() override {
    test::GlTest::SetUp();
    std::ofstream(folder_.path("projector.yaml")) << kLens;
    std::ofstream(folder_.path("config.yaml")) << kConfig;
  }

  geometry_msgs::TransformStamped transform(const std::string& child) const {
    geometry_msgs::TransformStamped message;
    message.header.frame_id = "map";
    message.child_frame_id = child;
    message.transform = toTransform(cloud_.T_map_camera);  // the projector stands there, too
    return message;
  }

  test::TableCloud cloud_;
  test::TempFolder folder_;
};

TEST_F(FindSurfaces, layersAreDarkUntilTheServiceHasFoundTheirSurface) {
  auto transforms = nh_->advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
  tf2_msgs::TFMessage all;
  all.transforms = {transform("camera"), transform("projector")};
  transforms.publish(all);
  auto markers = nh_->advertise<visualization_msgs::Marker>("/marker", 1, true);
  visualization_msgs::Marker marker;
  marker.header.frame_id = "map";
  marker.type = visualization_msgs::Marker::CUBE;
  marker.pose.position.x = 0.9;
  marker.pose.position.z = 1;
  marker.pose.orientation.w = 1;
  marker.scale.x = marker.scale.y = marker.scale.z = 0.3;
  marker.color.r = marker.color.a = 1;
  markers.publish(marker);
  auto clouds = nh_->advertise<sensor_msgs::PointCloud2>("/depth", 1, true);

  std::mutex mutex;
  std::string said;
  std::atomic<int> dark{0}, lit{0};
  const auto images = nh_->subscribe<sensor_msgs::Image>(
      "/finding/image", 1, [&](const sensor_msgs::ImageConstPtr& image) {
        const bool any = std::any_of(image->data.begin(), image->data.end(),
                                     [](std::uint8_t value) { return value > 0; });
        ++(any ? lit : dark);
      });
  const auto diagnostics = nh_->subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 5, [&](const diagnostic_msgs::DiagnosticArrayConstPtr& array) {
        for (const auto& status : array->status) {
          const std::lock_guard<std::mutex> lock(mutex);
          if (status.name == "finding: projector") said = status.message;
        }
      });
  const auto isSaid = [&](const std::string& text) {
    return eventually([&] {
      const std::lock_guard<std::mutex> lock(mutex);
      return said == text;
    });
  };
  test::NodeProcess node({AFTERGLOW_TEST_PROJECTOR_NODE, "__name:=finding",
                          "_config:=" + folder_.path("config.yaml"), "_window:=false"});
  ASSERT_TRUE(isSaid("surface 'table': is to be found; call find_surfaces")) << said;
  ASSERT_TRUE(eventually([&] { return dark > 0; }));
  EXPECT_EQ(lit, 0);

  clouds.publish(test::cloudMessage("camera", {{0, 0, 1}}));
  std_srvs::Trigger call;
  ASSERT_TRUE(ros::service::call("/finding/find_surfaces", call));
  EXPECT_FALSE(call.response.success);
  EXPECT_EQ(call.response.message.find("surface 'table': too few points"), 0u)
      << call.response.message;
  EXPECT_TRUE(isSaid(call.response.message)) << said;
  EXPECT_EQ(lit, 0);

  clouds.publish(cloud_.message("camera"));
  ASSERT_TRUE(ros::service::call("/finding/find_surfaces", call));
  EXPECT_TRUE(call.response.success) << call.response.message;
  EXPECT_EQ(call.response.message.find("surface 'table': 0.99 x 0.59 m at height 0.700 m"), 0u)
      << call.response.message;
  EXPECT_TRUE(eventually([&] { return lit > 0; }));
  EXPECT_TRUE(isSaid("projecting")) << said;
}

}  // namespace
}  // namespace afterglow::nodes::find_surfaces_ros_test
