#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nodes/conversion/path_conversion.hpp"
#include "nodes/conversion/scan_conversion.hpp"

namespace afterglow::nodes {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

sensor_msgs::LaserScan scan(std::vector<float> ranges) {
  sensor_msgs::LaserScan message;
  message.angle_min = static_cast<float>(-M_PI / 2);
  message.angle_increment = static_cast<float>(M_PI / 2);
  message.range_min = 0.1f;
  message.range_max = 10;
  message.ranges = std::move(ranges);
  return message;
}

nav_msgs::Path path(const std::vector<Eigen::Vector3d>& points) {
  nav_msgs::Path message;
  message.header.frame_id = "map";
  for (const Eigen::Vector3d& point : points) {
    geometry_msgs::PoseStamped pose;
    pose.pose.position.x = point.x();
    pose.pose.position.y = point.y();
    pose.pose.position.z = point.z();
    message.poses.push_back(pose);
  }
  return message;
}

TEST(ScanConversion, turnsCounterClockwiseFromX) {
  const auto cloud = toPointCloud(scan({1, 2, 3}), {});
  ASSERT_TRUE(cloud.value);
  ASSERT_EQ(cloud.value->points.size(), 3u);
  EXPECT_LT((cloud.value->points[0] - Eigen::Vector3f(0, -1, 0)).norm(), 1e-6f);
  EXPECT_LT((cloud.value->points[1] - Eigen::Vector3f(2, 0, 0)).norm(), 1e-6f);
  EXPECT_LT((cloud.value->points[2] - Eigen::Vector3f(0, 3, 0)).norm(), 1e-6f);
}

TEST(ScanConversion, leavesOutWhatIsNoReturn) {
  const auto cloud = toPointCloud(scan({kNan, kInf, -kInf, 0.05f, 10.1f, 0.1f, 10}), {});
  ASSERT_TRUE(cloud.value);
  EXPECT_EQ(cloud.value->points.size(), 2u);  // the limits themselves are in range
  auto endless = scan({kInf, 5});
  endless.range_max = kInf;
  EXPECT_EQ(toPointCloud(endless, {}).value->points.size(), 1u);
}

TEST(ScanConversion, colorsByIntensity) {
  CloudStyle style;
  style.color = ColorSource::Intensity;
  auto message = scan({1, kNan, 1});
  message.intensities = {0, 500, 100};
  const auto cloud = toPointCloud(message, style);
  ASSERT_TRUE(cloud.value);
  EXPECT_EQ(cloud.value->colors, (render::ColorList{{1, 0, 0, 1}, {1, 0, 1, 1}}));
  message.intensities.pop_back();
  EXPECT_EQ(toPointCloud(message, style).reason, "intensities are not as many as ranges");
  EXPECT_TRUE(toPointCloud(message, {}).value);
}

TEST(ScanConversion, refusesAnglesAndLimitsThatAreNoNumbers) {
  auto message = scan({1});
  message.angle_increment = kNan;
  EXPECT_EQ(toPointCloud(message, {}).reason, "scan angles are not finite");
  message = scan({1});
  message.range_max = kNan;
  EXPECT_EQ(toPointCloud(message, {}).reason, "range limits are no numbers");
  EXPECT_TRUE(toPointCloud(sensor_msgs::LaserScan(), {}).value);  // clears
}

TEST(PathConversion, joinsThePosesWithoutRepeatedPoints) {
  const auto line = toLines(path({{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 1, 0}}), 0.05f);
  ASSERT_TRUE(line.value);
  EXPECT_EQ(line.value->points.size(), 3u);
  EXPECT_EQ(line.value->width, 0.05f);
  EXPECT_TRUE(line.value->strip);
}

TEST(PathConversion, takesFewerThanTwoPointsForAValueThatClears) {
  EXPECT_TRUE(toLines(path({}), 0.05f).value->points.empty());
  EXPECT_TRUE(toLines(path({{1, 1, 1}, {1, 1, 1}}), 0.05f).value->points.empty());
}

TEST(PathConversion, refusesBadPosesAndMixedFrames) {
  EXPECT_EQ(toLines(path({{0, 0, 0}, {1, std::nan(""), 0}}), 0.05f).reason,
            "a pose is not finite or absurdly far");
  auto message = path({{0, 0, 0}, {1, 0, 0}});
  message.poses[1].header.frame_id = "/map";
  EXPECT_TRUE(toLines(message, 0.05f).value);
  message.poses[1].header.frame_id = "odom";
  EXPECT_EQ(toLines(message, 0.05f).reason, "a pose is in another frame than its path");
}

}  // namespace
}  // namespace afterglow::nodes
