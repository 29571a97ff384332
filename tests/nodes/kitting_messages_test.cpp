// What the paper's authors send (arrow_projection, robot-behavior-replay), field by field.
#include "nodes/kitting/kitting_messages.hpp"

#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

namespace afterglow::nodes::kitting_messages_test {
namespace {

using visualization_msgs::Marker;

TEST(KittingMessages, pathIsArrowsWithGapsAndASphereAtTheGoal) {
  PathMarkerStyle style;
  style.spacing = 0.25;
  const auto array = pathMarkers("map", {{0, 0}, {0, 2}}, style);
  ASSERT_EQ(array.markers.size(), 5u);
  for (std::size_t i = 0; i < 4; ++i) {
    const Marker& arrow = array.markers[i];
    EXPECT_EQ(arrow.type, Marker::ARROW);
    ASSERT_EQ(arrow.points.size(), 2u);
    EXPECT_NEAR(arrow.points[0].y, 0.5 * static_cast<double>(i), 1e-12);
    EXPECT_NEAR(arrow.points[1].y, 0.5 * static_cast<double>(i) + 0.25, 1e-12);
    EXPECT_EQ(arrow.color.r, 1);
    EXPECT_EQ(arrow.color.g, 0);
    EXPECT_EQ(arrow.color.b, 1);
  }
  EXPECT_EQ(array.markers[4].type, Marker::SPHERE);
  EXPECT_EQ(array.markers[4].pose.position.y, 2);
  EXPECT_EQ(array.markers[4].color.g, 1);
  for (std::size_t i = 0; i < 5; ++i) {
    const Marker& marker = array.markers[i];
    EXPECT_EQ(marker.id, static_cast<int>(i));
    EXPECT_EQ(marker.ns, "");
    EXPECT_EQ(marker.header.frame_id, "map");
    EXPECT_TRUE(marker.header.stamp.isZero());
    EXPECT_EQ(marker.lifetime, ros::Duration(10));
    EXPECT_EQ(marker.pose.orientation.w, 0);
  }
}

TEST(KittingMessages, sectionIsAWhiteCubeForAMinuteUntilItIsRemoved) {
  const Marker cube = sectionMarker("base_link", Eigen::Isometry3d::Identity(), {0.12, 0.12, 0.10});
  EXPECT_EQ(cube.type, Marker::CUBE);
  EXPECT_EQ(cube.lifetime, ros::Duration(60));
  EXPECT_EQ(cube.color.r, 255);
  EXPECT_EQ(cube.scale.z, 0.10);
  const Marker removed = removedSectionMarker("base_link");
  EXPECT_EQ(removed.action, Marker::DELETE);
  EXPECT_EQ(removed.ns, cube.ns);
  EXPECT_EQ(removed.id, cube.id);
}

TEST(KittingMessages, cloudHoldsThePointsAndNoneClears) {
  const auto cloud = pointCloud("base_link", ros::Time(3), {{1, 2, 3}, {4, 5, 6}});
  EXPECT_EQ(cloud.width * cloud.height, 2u);
  EXPECT_EQ(cloud.data.size(), 2 * cloud.point_step);
  sensor_msgs::PointCloud2ConstIterator<float> z(cloud, "z");
  EXPECT_EQ(*z, 3);
  EXPECT_EQ(*++z, 6);
  const auto none = pointCloud("base_link", ros::Time(3), {});
  EXPECT_EQ(none.width, 0u);
  EXPECT_EQ(none.fields.size(), 3u);
}

TEST(KittingMessages, solidsKeepTheirPlaceInTheFrameTheyAreGivenIn) {
  Thing thing;
  thing.name = "thing";
  Part box, prism;
  box.T_thing_part.translation() << 0, 0, 1;
  prism.shape = Part::Shape::Prism;
  prism.outline = {{0, 0}, {1, 0}, {0, 1}};
  thing.parts = {box, prism};
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 5, 0, 0;
  const auto array = solidMarkers(thing, "gripper_link", T);
  ASSERT_EQ(array.markers.size(), 2u);
  EXPECT_EQ(array.markers[0].type, Marker::CUBE);
  EXPECT_EQ(array.markers[0].header.frame_id, "gripper_link");
  EXPECT_EQ(array.markers[0].pose.position.x, 5);
  EXPECT_EQ(array.markers[0].pose.position.z, 1);
  EXPECT_EQ(array.markers[1].type, Marker::TRIANGLE_LIST);
  EXPECT_EQ(array.markers[1].points.size(), 8u * 3);
  EXPECT_NE(array.markers[0].id, array.markers[1].id);
}

TEST(KittingMessages, scanCoversItsBeams) {
  const ScanGeometry geometry;
  const auto scan = laserScan("laser_link", ros::Time(1), geometry, {});
  EXPECT_NEAR(scan.angle_max, geometry.angle_min + geometry.angle_increment * (geometry.beams - 1),
              1e-5);
}

TEST(KittingMessages, speechIsSaidOnceAtFullVolume) {
  const auto request = sayRequest("Hello.", "en-us");
  EXPECT_EQ(request.sound, sound_play::SoundRequest::SAY);
  EXPECT_EQ(request.command, sound_play::SoundRequest::PLAY_ONCE);
  EXPECT_EQ(request.volume, 1);
  EXPECT_EQ(request.arg, "Hello.");
  EXPECT_EQ(request.arg2, "en-us");
}

}  // namespace
}  // namespace afterglow::nodes::kitting_messages_test
