// projector_node keeps its light off people and the robot, or lights nothing and says why.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/Marker.h>

#include <cmath>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "tests/support/cloud_messages.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/projector_info.hpp"
#include "tests/support/ros_graph.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::light_avoidance_ros_test {
namespace {

using test::eventually;

const char kRobot[] = R"(<robot name="small"><link name="base"/>
  <link name="arm"><visual><geometry><box size="0.2 0.1 0.1"/></geometry></visual></link>
  <joint name="arm" type="continuous"><parent link="base"/><child link="arm"/>
    <axis xyz="0 0 1"/></joint></robot>)";

const Eigen::Vector3d kHead(-0.2, 0.15, 1), kArm(-0.25, -0.15, 0.7), kFloor(0.1, 0, 0);

/// White light on the floor around the origin, 2.2 m below two projectors of one lens, one of them
/// mirrored and drawn by OpenGL.
const char kConfig[] =
    "fixed_frame: map\n"
    "projectors:\n"
    "  left: {camera_info: projector.yaml, frame: lens, drawing: cpu}\n"
    "  right: {camera_info: projector.yaml, frame: lens, drawing: opengl, mirror: horizontal}\n"
    "surfaces: {floor: {frame: map}}\n"
    "layers: [{topic: /marker, type: visualization_msgs/Marker}]\n"
    "avoid:\n"
    "  from: [{topic: /points, type: sensor_msgs/PointCloud2, padding: 0.05}]\n"
    "  robot: {padding: 0.05}\n"
    "  speed: 0\n"
    "  patience_s: 2\n";

geometry_msgs::TransformStamped transform(const std::string& parent, const std::string& child,
                                          const Eigen::Isometry3d& T) {
  geometry_msgs::TransformStamped message;
  message.header.frame_id = parent;
  message.child_frame_id = child;
  message.header.stamp = ros::Time::now();
  message.transform = toTransform(T);
  return message;
}

/// The lens throws upwards (cy = 817): the axis passes below what is in the picture's middle.
Eigen::Isometry3d lensPose() {
  Eigen::Isometry3d T = test::lookAt<Projector>({-0.6, 0, 2.2}, {0, 0, 0}).matrix();
  T.rotate(Eigen::AngleAxisd(-std::atan((817.0 - 400) / 1900), Eigen::Vector3d::UnitX()));
  return T;
}

class LightAvoidanceRosTest : public test::RosGraph<test::GlTest> {
 protected:
  void SetUp() override {
    test::RosGraph<test::GlTest>::SetUp();
    if (IsSkipped()) return;
    std::ofstream(folder_.path("projector.yaml")) << test::projectorInfo(test::Source::Generated);
    std::ofstream(folder_.path("config.yaml")) << kConfig;
    fixed_ = nh_->advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
    moving_ = nh_->advertise<tf2_msgs::TFMessage>("/tf", 10);
    points_ = nh_->advertise<sensor_msgs::PointCloud2>("/points", 1);
    marker_ = nh_->advertise<visualization_msgs::Marker>("/marker", 1, true);
    tf2_msgs::TFMessage message;
    message.transforms = {transform("map", "lens", lensPose()),
                          transform("map", "base", Eigen::Isometry3d::Identity())};
    fixed_.publish(message);
    visualization_msgs::Marker light;
    light.header.frame_id = "map";
    light.type = visualization_msgs::Marker::CUBE;
    light.pose.orientation.w = light.color.r = light.color.g = light.color.b = light.color.a = 1;
    light.scale.x = light.scale.y = 6;
    light.scale.z = 0.001;
    marker_.publish(light);
    for (const std::string name : {"left", "right"}) {
      images_.push_back(nh_->subscribe<sensor_msgs::Image>(
          "/keeping/" + name + "/image", 1, [this, name](const sensor_msgs::ImageConstPtr& m) {
            const std::lock_guard<std::mutex> lock(mutex_);
            newest_[name] = {static_cast<int>(m->width), static_cast<int>(m->height), m->data};
          }));
    }
    diagnostics_ = nh_->subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 10, [this](const diagnostic_msgs::DiagnosticArrayConstPtr& array) {
          const std::lock_guard<std::mutex> lock(mutex_);
          for (const auto& status : array->status) {
            said_[status.name] = std::to_string(status.level) + " " + status.message;
          }
        });
  }

  void seePerson() {
    std::vector<Eigen::Vector3f> points = {kFloor.cast<float>()};
    for (float x = -0.05f; x <= 0.05f; x += 0.01f) {
      for (float y = -0.05f; y <= 0.05f; y += 0.01f) {
        points.push_back(kHead.cast<float>() + Eigen::Vector3f(x, y, 0));
      }
    }
    auto message = test::cloudMessage("map", points);
    message.header.stamp = ros::Time::now();
    points_.publish(message);
  }
  void moveArm() {
    tf2_msgs::TFMessage message;
    message.transforms = {transform("base", "arm", Eigen::Isometry3d(Eigen::Translation3d(kArm)))};
    moving_.publish(message);
  }
  bool isSaid(const std::string& projector, const std::string& text) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return said_["keeping: " + projector].find(text) != std::string::npos;
  }
  std::string said(const std::string& projector) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return said_["keeping: " + projector];
  }
  /// The brightness where light would hit a place, by OpenCV.
  int lightAt(const std::string& projector, const Eigen::Vector3d& p) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const render::Image& image = newest_[projector];
    if (image.rgb.empty()) return -1;
    const Eigen::Vector2d pixel =
        test::projectWithOpenCv(test::viewsonic(), {lensPose().inverse() * p})[0];
    const int u = static_cast<int>(std::lround(pixel.x()));
    return test::brightness(image, projector == "right" ? image.width - 1 - u : u,
                            static_cast<int>(std::lround(pixel.y())));
  }
  bool isLit(const std::string& projector) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return render::isLit(newest_[projector]);
  }

  test::TempFolder folder_;
  ros::Publisher fixed_, moving_, points_, marker_;
  std::vector<ros::Subscriber> images_;
  ros::Subscriber diagnostics_;
  std::mutex mutex_;
  std::map<std::string, render::Image> newest_;
  std::map<std::string, std::string> said_;
};

TEST_F(LightAvoidanceRosTest, lightsWhatIsFreeOnceItKnowsPeopleAndTheArmAndNothingBefore) {
  nh_->deleteParam("robot_description");
  test::NodeProcess node({AFTERGLOW_TEST_PROJECTOR_NODE, "__name:=keeping",
                          "_config:=" + folder_.path("config.yaml"),
                          "_calibration:=" + folder_.path(""), "_window:=false"});
  const std::vector<std::string> both = {"projector left", "projector right"};
  for (const std::string& projector : both) {
    EXPECT_TRUE(eventually([&] {
      return isSaid(projector, "2 projector: avoid: /points: no message yet; nothing is lit");
    })) << said(projector);
  }
  EXPECT_TRUE(eventually([&] {
    seePerson();
    return isSaid(both[0], "avoid: no robot's description on parameter robot_description");
  })) << said(both[0]);
  nh_->setParam("robot_description", kRobot);
  EXPECT_TRUE(eventually([&] {
    seePerson();
    return isSaid(both[1], "avoid: the robot: no transform from 'arm' to 'lens'");
  })) << said(both[1]);
  EXPECT_FALSE(isLit("left") || isLit("right"));

  for (const std::string projector : {"left", "right"}) {
    ASSERT_TRUE(eventually([&] {
      seePerson();
      moveArm();
      return lightAt(projector, kFloor) > 700;
    })) << said("projector " + projector)
        << node.log();
    EXPECT_EQ(lightAt(projector, kHead), 0) << projector;
    EXPECT_EQ(lightAt(projector, kHead + Eigen::Vector3d(0.08, 0, 0)), 0) << "padding";
    EXPECT_EQ(lightAt(projector, kArm), 0) << projector;
    EXPECT_GT(lightAt(projector, kArm + Eigen::Vector3d(0, 0.25, 0)), 700) << projector;
    EXPECT_GT(lightAt(projector, kHead + Eigen::Vector3d(0.18, 0, 0)), 700) << projector;
  }
  EXPECT_TRUE(eventually([&] {
    seePerson();
    moveArm();
    return isSaid(both[0], "% of the picture is kept dark ('avoid')");
  })) << said(both[0]);

  EXPECT_TRUE(eventually([&] {
    moveArm();
    return isSaid(both[0], "2 projector: avoid: /points is stale: what it saw is ");
  })) << said(both[0]);
  EXPECT_TRUE(eventually([&] { return !isLit("left") && !isLit("right"); }));
  nh_->deleteParam("robot_description");
}

}  // namespace
}  // namespace afterglow::nodes::light_avoidance_ros_test
