// projector_node under broken clocks and transforms: it goes on, dark where it must be, and says
// why.
#include <gtest/gtest.h>
#include <rosgraph_msgs/Clock.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/Marker.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <fstream>
#include <limits>
#include <string>

#include "tests/support/gl_context.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_graph.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::projector_faults_ros_test {
namespace {

using test::eventually;

constexpr std::uint32_t kLastSecond = std::numeric_limits<std::uint32_t>::max();

const char kConfig[] =
    "fixed_frame: map\n"
    "projector: {camera_info: lens.yaml, frame: projector, latency_ms: 500}\n"
    "layers:\n"
    "  - {topic: /marker, type: visualization_msgs/Marker}\n";
const char kLens[] =
    "image_width: 160\nimage_height: 120\ncamera_name: p\ndistortion_model: plumb_bob\n"
    "camera_matrix: {rows: 3, cols: 3, data: [150, 0, 80, 0, 150, 60, 0, 0, 1]}\n"
    "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n";

class ProjectorFaults : public test::RosGraph<test::GlTest> {
 protected:
  void SetUp() override {
    test::GlTest::SetUp();
    nh_->setParam("/use_sim_time", true);
    std::ofstream(folder_.path("config.yaml")) << kConfig;
    std::ofstream(folder_.path("lens.yaml")) << kLens;
    clock_ = nh_->advertise<rosgraph_msgs::Clock>("/clock", 1, true);
    moving_ = nh_->advertise<tf2_msgs::TFMessage>("/tf", 100);
    fixed_ = nh_->advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
    markers_ = nh_->advertise<visualization_msgs::Marker>("/marker", 1, true);
    images_ = nh_->subscribe<sensor_msgs::Image>(
        "/projector/image", 1, [this](const sensor_msgs::ImageConstPtr& image) {
          lit_ = std::count(image->data.begin(), image->data.end(), 0) <
                 static_cast<std::ptrdiff_t>(image->data.size());
          second_ = image->header.stamp.sec;
        });
    tf2_msgs::TFMessage message;
    message.transforms = {transform("projector", ros::Time(1))};
    fixed_.publish(message);
  }

  static geometry_msgs::TransformStamped transform(const std::string& frame, ros::Time stamp) {
    geometry_msgs::TransformStamped message;
    message.header.frame_id = "map";
    message.header.stamp = stamp;
    message.child_frame_id = frame;
    message.transform.rotation.w = 1;
    return message;
  }
  void setClock(ros::Time time) {
    rosgraph_msgs::Clock message;
    message.clock = time;
    clock_.publish(message);
  }
  void publishCube() {
    visualization_msgs::Marker cube;
    cube.header.frame_id = "map";
    cube.type = visualization_msgs::Marker::CUBE;
    cube.pose.position.z = 2;
    cube.scale.x = cube.scale.y = cube.scale.z = cube.color.g = cube.color.a = 1;
    markers_.publish(cube);
  }
  bool becomes(bool lit) {
    return eventually([&] { return lit_ == lit; });
  }

  test::TempFolder folder_;
  ros::Publisher clock_, moving_, fixed_, markers_;
  ros::Subscriber images_;
  std::atomic<bool> lit_{false};
  std::atomic<std::uint32_t> second_{0};
};

/// Nothing but what is logged tells.
bool isLogged(const test::NodeProcess& node, const std::string& text) {
  return eventually([&] { return node.log().find(text) != std::string::npos; });
}

TEST_F(ProjectorFaults, outlivesClocksAndTransformsThatLie) {
  const test::NodeProcess node({AFTERGLOW_TEST_PROJECTOR_NODE, "__name:=projector",
                                "_config:=" + folder_.path("config.yaml"), "_window:=false"});
  EXPECT_TRUE(isLogged(node, "projector: waiting for /clock")) << node.log();
  setClock(ros::Time(1000));
  publishCube();
  ASSERT_TRUE(becomes(true)) << node.log();

  setClock(ros::Time(10));
  EXPECT_TRUE(becomes(false)) << "what was shown belongs to another time";
  EXPECT_TRUE(isLogged(node, "ROS time has jumped back: the projection is cleared"));
  publishCube();
  EXPECT_TRUE(becomes(true));

  ASSERT_TRUE(eventually([&] { return moving_.getNumSubscribers() > 0; }));
  tf2_msgs::TFMessage bad;
  bad.transforms.assign(50, transform("projector", ros::Time(kLastSecond, 999'999'999)));
  for (auto& copy : bad.transforms) copy.transform.translation.x = 100;
  bad.transforms[1].header.stamp = ros::Time(10);
  bad.transforms[1].transform.translation.x = std::numeric_limits<double>::quiet_NaN();
  moving_.publish(bad);
  EXPECT_TRUE(isLogged(
      node, "/tf: dropped: transform of 'projector': stamp lies in the future (49 times)"));
  EXPECT_TRUE(isLogged(node, "/tf: dropped: transform of 'projector': not finite or absurdly far"));

  setClock(ros::Time(kLastSecond, 900'000'000));  // 0.5 s later is no ROS time
  EXPECT_TRUE(eventually([&] { return second_ == kLastSecond; })) << node.log();
  EXPECT_TRUE(becomes(true));
}

/// As fast as they can be sent. Nobody takes the pictures for a window, either.
TEST_F(ProjectorFaults, drawsOnThroughAFlood) {
  const test::NodeProcess node({AFTERGLOW_TEST_PROJECTOR_NODE, "__name:=projector",
                                "_config:=" + folder_.path("config.yaml"), "_window:=false"});
  setClock(ros::Time(1000));
  ASSERT_TRUE(eventually([&] { return markers_.getNumSubscribers() > 0; }));
  publishCube();
  ASSERT_TRUE(becomes(true)) << node.log();
  constexpr int kMessages = 20'000;
  for (int i = 0; i < kMessages; ++i) {
    if (i % 1000 == 0) setClock(ros::Time(1001 + i / 1000));
    publishCube();
  }
  setClock(ros::Time(1100));
  EXPECT_TRUE(eventually([&] { return second_ >= 1100; })) << node.log();
  EXPECT_TRUE(becomes(true));
  visualization_msgs::Marker none;
  none.action = visualization_msgs::Marker::DELETEALL;
  markers_.publish(none);
  EXPECT_TRUE(becomes(false)) << "what comes behind the flood is obeyed";
}

}  // namespace
}  // namespace afterglow::nodes::projector_faults_ros_test
