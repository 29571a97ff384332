#include "nodes/observer/observer_scene.hpp"

#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <sensor_msgs/image_encodings.h>

#include <limits>
#include <string>

#include "nodes/observer/room_solids.hpp"
#include "render/scene/relief.hpp"

namespace afterglow::nodes::observer_scene_test {
namespace {

constexpr std::uint32_t kWidth = 64, kHeight = 48;

ros::Time at(double seconds) { return ros::Time(1000 + seconds); }

struct ObserverSceneTest : ::testing::Test {
  tf2::BufferCore tf;
  ObserverScene scene{RoomView{"map", 64, 48, {}, {}, {}}, tf};

  void place(const std::string& frame, double x, ros::Time stamp) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = "map";
    transform.header.stamp = stamp;
    transform.child_frame_id = frame;
    transform.transform.translation.x = x;
    transform.transform.rotation.w = 1;
    tf.setTransform(transform, "test");
  }
  static sensor_msgs::Image image(ros::Time stamp, std::uint8_t level = 100) {
    sensor_msgs::Image message;
    message.header.frame_id = "projector_optical_frame";
    message.header.stamp = stamp;
    message.encoding = sensor_msgs::image_encodings::RGB8;
    message.width = kWidth;
    message.height = kHeight;
    message.step = kWidth * 3 + 5;  // rows may be padded
    message.data.assign(std::size_t{message.step} * kHeight, level);
    return message;
  }
  static sensor_msgs::CameraInfo info(std::uint32_t width = kWidth) {
    sensor_msgs::CameraInfo message;
    message.width = width;
    message.height = kHeight;
    message.K = {50, 0, 32, 0, 50, 24, 0, 0, 1};
    message.D = {0, 0, 0, 0, 0};
    return message;
  }
  static visualization_msgs::Marker cube(const std::string& frame) {
    visualization_msgs::Marker marker;
    marker.header.frame_id = frame;
    marker.type = visualization_msgs::Marker::CUBE;
    marker.frame_locked = 1;
    marker.scale.x = marker.scale.y = marker.scale.z = 0.1;
    marker.color.a = 1;
    return marker;
  }
  static double x(const Rigid<Projector, World>& T_projector_world) {
    return T_projector_world.inverse().matrix().translation().x();
  }
};

TEST_F(ObserverSceneTest, throwsTheLightFromWhereTheProjectorWas) {
  scene.setLens(info());
  place("projector_optical_frame", 1, at(0));
  place("projector_optical_frame", 2, at(1));
  scene.addImage(image(at(0.5)));
  const render::ProjectedLight* light = scene.light(at(1));
  ASSERT_NE(light, nullptr);
  EXPECT_NEAR(x(light->T_projector_world), 1.5, 1e-9);
  EXPECT_EQ(light->image.rgb.size(), std::size_t{kWidth} * kHeight * 3);
}

TEST_F(ObserverSceneTest, seesAMirroredPictureByItsMirror) {
  auto mirrored = info();
  mirrored.K[0] = -50;
  mirrored.K[2] = kWidth - 1 - 30;
  scene.setLens(mirrored);
  place("projector_optical_frame", 1, at(0));
  auto picture = image(at(0), 0);
  picture.data[3 * 5] = 255;  // in the first row
  scene.addImage(picture);
  const render::ProjectedLight* light = scene.light(at(0));
  ASSERT_NE(light, nullptr);
  EXPECT_EQ(light->lens.K(0, 0), 50);
  EXPECT_EQ(light->lens.K(0, 2), 30);
  EXPECT_EQ(light->lens.K(1, 1), 50);
  EXPECT_EQ(light->image.rgb[3 * (kWidth - 1 - 5)], 255);
  EXPECT_EQ(scene.projectorImage()->rgb[3 * 5], 255);  // as it is sent
}

TEST_F(ObserverSceneTest, keepsAPictureUntilItsPoseIsKnown) {
  scene.setLens(info());
  place("projector_optical_frame", 1, at(0));
  place("projector_optical_frame", 2, at(1));
  scene.addImage(image(at(0.5), 10));
  scene.addImage(image(at(1.2), 20));
  ASSERT_NE(scene.light(at(1.3)), nullptr);
  EXPECT_EQ(scene.light(at(1.3))->image.rgb[0], 10);
  EXPECT_EQ(scene.projectorImage()->rgb[0], 20);
  place("projector_optical_frame", 4, at(2));
  ASSERT_NE(scene.light(at(2)), nullptr);
  EXPECT_EQ(scene.light(at(2))->image.rgb[0], 20);
  EXPECT_NEAR(x(scene.light(at(2))->T_projector_world), 2.4, 1e-9);
}

TEST_F(ObserverSceneTest, isDarkWithoutLensPoseOrNews) {
  place("projector_optical_frame", 1, at(0));
  place("projector_optical_frame", 1, at(5));
  scene.addImage(image(at(1)));
  EXPECT_EQ(scene.light(at(1)), nullptr) << "no lens";
  scene.setLens(info());
  EXPECT_NE(scene.light(at(1)), nullptr);
  EXPECT_NE(scene.light(at(2.9)), nullptr);
  EXPECT_EQ(scene.light(at(3.1)), nullptr) << "two seconds without a picture";
}

TEST_F(ObserverSceneTest, countsPicturesThatAreNone) {
  place("projector_optical_frame", 1, at(0));
  place("projector_optical_frame", 1, at(5));
  scene.setLens(info());
  sensor_msgs::Image wrong = image(at(1));
  wrong.encoding = "mono8";
  scene.addImage(wrong);
  wrong = image(at(1));
  wrong.data.resize(100);
  scene.addImage(wrong);
  EXPECT_EQ(scene.projectorImage(), nullptr);
  scene.setLens(info(kWidth + 1));
  scene.addImage(image(at(1)));
  EXPECT_EQ(scene.light(at(1)), nullptr);
  sensor_msgs::CameraInfo no_lens = info();
  no_lens.K[0] = 0;
  scene.setLens(no_lens);
  const auto dropped = scene.status().dropped;
  EXPECT_EQ(dropped.at("the projector's image is not rgb8 or its size is wrong"), 2u);
  EXPECT_EQ(dropped.at("the projector's image has not the size of its lens"), 1u);
  EXPECT_EQ(dropped.at("camera_info is no lens"), 1u);
}

TEST_F(ObserverSceneTest, carriesSolidsWithTheirFrame) {
  EXPECT_FALSE(scene.isFurnished());
  visualization_msgs::MarkerArray solids;
  solids.markers.push_back(cube("gripper_link"));
  place("gripper_link", 1, at(0));
  scene.addSolids(solids, at(0));
  EXPECT_TRUE(scene.isFurnished());
  ASSERT_EQ(scene.solids(at(0)).size(), 1u);
  EXPECT_NEAR(scene.solids(at(0))[0].pose.matrix().translation().x(), 1, 1e-9);
  place("gripper_link", 3, at(1));
  EXPECT_NEAR(scene.solids(at(1))[0].pose.matrix().translation().x(), 3, 1e-9);
  solids.markers[0].action = visualization_msgs::Marker::DELETEALL;
  scene.addSolids(solids, at(1));
  EXPECT_TRUE(scene.solids(at(1)).empty());
}

TEST_F(ObserverSceneTest, showsTheLinksThatTfKnows) {
  scene.setRobot(RobotModel::fromFile("assets/fetch.urdf"));
  EXPECT_TRUE(scene.isFurnished());
  EXPECT_TRUE(scene.solids(at(0)).empty());
  place("base_link", 1, at(0));
  const auto base = scene.solids(at(0));
  ASSERT_FALSE(base.empty());
  EXPECT_LT(base.size(), 20u);
  EXPECT_NEAR(base[0].pose.matrix().translation().x(), 1, 0.5);
}

render::Triangles trianglesOf(const render::SurfacePatch& surface) {
  const auto solids = surfaceSolids({{}, {surface}}, {2, 1, 1.5});
  EXPECT_EQ(solids.size(), 1u);
  return std::get<render::Triangles>(solids.at(0).shape);
}

TEST(RoomSolids, areSlabsUnderTheirSurfacesPlane) {
  // Clockwise, and not convex: the corner at the origin is cut out.
  const render::Triangles slab =
      trianglesOf({"table", {}, {{0, 1}, {1, 1}, {1, -1}, {-1, -1}, {-1, 0}, {0, 0}}});
  float top_area = 0, lowest = 0;
  for (std::size_t i = 0; i < slab.points.size(); i += 3) {
    const Eigen::Vector3f &a = slab.points[i], &b = slab.points[i + 1], &c = slab.points[i + 2];
    const Eigen::Vector3f normal = (b - a).cross(c - a);
    if (a.z() > -0.01f && b.z() > -0.01f && c.z() > -0.01f) top_area += normal.z() / 2;
    lowest = std::min({lowest, a.z(), b.z(), c.z()});
  }
  EXPECT_NEAR(top_area, 3, 1e-5) << "its upper side looks up";
  EXPECT_NEAR(lowest, -0.031, 1e-6);
}

TEST(RoomSolids, reachAroundTheProjectorWhereASurfaceIsEndless) {
  for (const Eigen::Vector3f& p : trianglesOf({"floor", {}, {}}).points) {
    EXPECT_NEAR(std::abs(p.x() - 2), 6, 1e-5);
    EXPECT_NEAR(std::abs(p.y() - 1), 6, 1e-5);
  }
}

TEST(RoomSolids, haveTheHeightsOfAReliefAndItsHoles) {
  const float hole = std::numeric_limits<float>::quiet_NaN();
  const auto relief = std::make_shared<const render::Relief>(
      Eigen::Vector2d(0, 0), 0.5, 3, 2, std::vector<float>{0, 0.1f, 0, 0, 0.2f, hole});
  const render::Triangles land = trianglesOf({"heap", {}, {}, relief});
  ASSERT_EQ(land.points.size(), 6u);
  EXPECT_NEAR(land.points[2].z(), 0.2 - 0.001, 1e-6);
  EXPECT_NEAR(land.points[2].x(), 0.5, 1e-6);
}

}  // namespace
}  // namespace afterglow::nodes::observer_scene_test
