// What the paper's authors send (arrow_projection, robot-behavior-replay), field by field.
#include "nodes/kitting/kitting_messages.hpp"

#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

namespace afterglow::nodes::kitting_messages_test {
namespace {

using visualization_msgs::Marker;

TEST(KittingMessages, pathIsArrowsWithGapsAndASphereAtTheGoal) {
  const auto array = pathMarkers({{0, 0}, {0, 2.1}});
  ASSERT_EQ(array.markers.size(), 5u);
  for (std::size_t i = 0; i < 4; ++i) {
    const Marker& arrow = array.markers[i];
    EXPECT_EQ(arrow.type, Marker::ARROW);
    ASSERT_EQ(arrow.points.size(), 2u);
    EXPECT_NEAR(arrow.points[0].y, 0.52 * static_cast<double>(i), 1e-12);
    EXPECT_NEAR(arrow.points[1].y, 0.52 * static_cast<double>(i) + 0.26, 1e-12);
    EXPECT_EQ(arrow.color.r, 1);
    EXPECT_EQ(arrow.color.g, 0);
    EXPECT_EQ(arrow.color.b, 1);
  }
  EXPECT_EQ(array.markers[4].type, Marker::SPHERE);
  EXPECT_EQ(array.markers[4].pose.position.y, 2.1);
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

TEST(KittingMessages, sectionIsAWhiteCubeForAMinute) {
  const Marker cube = sectionMarker(Eigen::Isometry3d::Identity(), {0.12, 0.12, 0.10});
  EXPECT_EQ(cube.type, Marker::CUBE);
  EXPECT_EQ(cube.lifetime, ros::Duration(60));
  EXPECT_EQ(cube.color.r, 255);
  EXPECT_EQ(cube.scale.z, 0.10);
}

TEST(KittingMessages, cloudHoldsThePointsAndNoneClears) {
  ros::Time::init();
  const auto cloud = pointCloud({{1, 2, 3}, {4, 5, 6}});
  EXPECT_EQ(cloud.width * cloud.height, 2u);
  EXPECT_EQ(cloud.data.size(), 2 * cloud.point_step);
  sensor_msgs::PointCloud2ConstIterator<float> z(cloud, "z");
  EXPECT_EQ(*z, 3);
  EXPECT_EQ(*++z, 6);
  const auto none = pointCloud({});
  EXPECT_EQ(none.width, 0u);
  EXPECT_EQ(none.fields.size(), 3u);
}

}  // namespace
}  // namespace afterglow::nodes::kitting_messages_test
