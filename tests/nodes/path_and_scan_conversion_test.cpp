#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "nodes/conversion/cloud_conversion.hpp"
#include "nodes/conversion/path_conversion.hpp"

namespace afterglow::nodes::path_and_scan_conversion_test {
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
  const auto scanned = toScanPoints(scan({1, 2, 3}), {});
  ASSERT_TRUE(scanned.value);
  const render::PointCloud& cloud = scanned.value->cloud;
  ASSERT_EQ(cloud.points.size(), 3u);
  EXPECT_LT((cloud.points[0] - Eigen::Vector3f(0, -1, 0)).norm(), 1e-6f);
  EXPECT_LT((cloud.points[1] - Eigen::Vector3f(2, 0, 0)).norm(), 1e-6f);
  EXPECT_LT((cloud.points[2] - Eigen::Vector3f(0, 3, 0)).norm(), 1e-6f);
}

TEST(ScanConversion, leavesOutWhatIsNoReturn) {
  const auto scanned = toScanPoints(scan({kNan, kInf, -kInf, 0.05f, 10.1f, 0.1f, 10}), {});
  ASSERT_TRUE(scanned.value);
  const render::PointCloud& cloud = scanned.value->cloud;
  EXPECT_EQ(cloud.points.size(), 2u);  // the limits themselves are in range
  auto endless = scan({kInf, 5});
  endless.range_max = kInf;
  EXPECT_EQ(toScanPoints(endless, {}).value->cloud.points.size(), 1u);
}

TEST(ScanConversion, colorsByIntensity) {
  CloudStyle style;
  style.color = ColorSource::Intensity;
  auto message = scan({1, kNan, 1});
  message.intensities = {0, 500, 100};
  const auto scanned = toScanPoints(message, style);
  ASSERT_TRUE(scanned.value);
  const render::PointCloud& cloud = scanned.value->cloud;
  EXPECT_EQ(cloud.colors, (render::ByteColorList{{255, 0, 0, 255}, {255, 0, 255, 255}}));
  message.intensities.pop_back();
  EXPECT_EQ(toScanPoints(message, style).reason, "intensities are not as many as ranges");
  EXPECT_TRUE(toScanPoints(message, {}).value);
}

TEST(ScanConversion, refusesAnglesAndLimitsThatAreNoNumbers) {
  auto message = scan({1, 1});
  message.angle_increment = kNan;
  EXPECT_EQ(toScanPoints(message, {}).reason, "scan angles are not finite");
  message = scan({1});
  message.range_max = kNan;
  EXPECT_EQ(toScanPoints(message, {}).reason, "range limits are no numbers");
  EXPECT_TRUE(toScanPoints(sensor_msgs::LaserScan(), {}).value);  // clears
}

TEST(ScanConversion, looksAtNoStepsOfASingleRay) {
  auto message = scan({2});
  message.angle_min = 0;
  message.angle_increment = message.time_increment = kNan;
  message.angle_max = message.scan_time = kNan;
  const auto scanned = toScanPoints(message, {});
  ASSERT_TRUE(scanned.value) << scanned.reason;
  EXPECT_EQ(scanned.value->cloud.points[0], Eigen::Vector3f(2, 0, 0));
  message.ranges.push_back(2);
  EXPECT_EQ(toScanPoints(message, {}).reason, "scan angles are not finite");
}

TEST(ScanConversion, colorsByIntensityWithinFixedBounds) {
  CloudStyle style;
  style.color = ColorSource::Intensity;
  style.scale.bounds = {0, 1000};
  auto message = scan({1, 1});
  message.intensities = {500, 1000};
  EXPECT_EQ(toScanPoints(message, style).value->cloud.colors[0], (render::Rgba{0, 255, 128, 255}));
}

TEST(ScanConversion, tellsWhenEachPointWasSeen) {
  auto message = scan({1, kNan, 3, kNan});
  EXPECT_TRUE(toScanPoints(message, {}).value->sweep.seconds.empty());
  message.time_increment = 0.5f;
  const Sweep sweep = toScanPoints(message, {}).value->sweep;
  EXPECT_EQ(sweep.seconds, (std::vector<float>{0, 1}));
  EXPECT_EQ(sweep.last_s, 1.5);  // of the last ray, though it did not return
}

TEST(ScanConversion, refusesTimesThatAreNone) {
  auto message = scan({1, 2});
  for (const float bad : {kNan, kInf, 11.f}) {
    message.time_increment = bad;
    EXPECT_EQ(toScanPoints(message, {}).reason, "time_increment is absurd");
  }
}

TEST(PathConversion, joinsThePosesWithoutRepeatedPoints) {
  PathStyle style;
  style.width = 0.05f;
  const auto shapes =
      toPathShapes(path({{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 1, 0}}), style);
  ASSERT_TRUE(shapes.value);
  ASSERT_EQ(shapes.value->strips.size(), 1u);
  const render::Lines& line = shapes.value->strips[0];
  EXPECT_EQ(line.points, (render::PointList{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}));
  EXPECT_EQ(line.width, 0.05f);
  EXPECT_EQ(line.width_px, 0);
  EXPECT_TRUE(line.strip);
  EXPECT_FALSE(shapes.value->glyphs);
  EXPECT_EQ(shapes.reason, "");
}

TEST(PathConversion, drawsLinesAsWideAsSoManyPixels) {
  PathStyle style;
  style.line = PathStyle::Line::Lines;
  style.width = 1;
  EXPECT_EQ(toPathShapes(path({{0, 0, 0}, {1, 0, 0}}), style).value->strips.at(0).width_px, 1);
}

TEST(PathConversion, takesFewerThanTwoPointsForAValueThatClears) {
  EXPECT_TRUE(toPathShapes(path({}), {}).value->strips.empty());
  EXPECT_TRUE(toPathShapes(path({{1, 1, 1}}), {}).value->strips.empty());
  EXPECT_TRUE(toPathShapes(path({{1, 1, 1}, {1, 1, 1}}), {}).value->strips.empty());
}

TEST(PathConversion, breaksTheLineAtABadPoseAndSaysSo) {
  const double nan = std::nan("");
  const auto shapes = toPathShapes(path({{nan, 0, 0},
                                         {0, 0, 0},
                                         {1, 0, 0},
                                         {2, nan, 0},
                                         {3, 0, 0},
                                         {4, 0, 0},
                                         {1e30, 0, 0},
                                         {5, 0, 0}}),
                                   {});
  ASSERT_TRUE(shapes.value);
  ASSERT_EQ(shapes.value->strips.size(), 2u);
  EXPECT_EQ(shapes.value->strips[0].points, (render::PointList{{0, 0, 0}, {1, 0, 0}}));
  EXPECT_EQ(shapes.value->strips[1].points, (render::PointList{{3, 0, 0}, {4, 0, 0}}));
  EXPECT_EQ(shapes.reason, "a pose is not finite or absurdly far: the line breaks there");
}

TEST(PathConversion, boundsTheNumberOfBreaks) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 5000; ++i) {
    points.insert(points.end(), {{0, 0, 0}, {1, 0, 0}, {std::nan(""), 0, 0}});
  }
  const auto shapes = toPathShapes(path(points), {});
  EXPECT_EQ(shapes.value->strips.size(), 1000u);
  EXPECT_NE(shapes.reason.find("the rest of the path is left out"), std::string::npos);
}

TEST(PathConversion, putsAllPosesInThePathsFrameAndSaysSo) {
  auto message = path({{0, 0, 0}, {1, 0, 0}});
  message.poses[1].header.frame_id = "/map";
  EXPECT_EQ(toPathShapes(message, {}).reason, "");
  message.poses[1].header.frame_id = "odom";
  const auto shapes = toPathShapes(message, {});
  EXPECT_EQ(shapes.value->strips.at(0).points.size(), 2u);
  EXPECT_EQ(shapes.reason, "a pose names another frame than its path, whose frame counts");
}

TEST(PathConversion, thinsOutAMillionPosesToWithinTheirSpacing) {
  std::vector<Eigen::Vector3d> points;
  constexpr int kPoses = 1'000'000;
  for (int i = 0; i < kPoses; ++i) {
    const double angle = 20 * M_PI * i / kPoses;
    points.emplace_back(10 * std::cos(angle), 10 * std::sin(angle), 0);
  }
  const auto shapes = toPathShapes(path(points), {});
  const render::PointList& kept = shapes.value->strips.at(0).points;
  EXPECT_LE(kept.size(), kMostPathPoints);
  EXPECT_GT(kept.size(), kMostPathPoints / 3);
  for (std::size_t i = 1; i < kept.size(); ++i) ASSERT_LT((kept[i] - kept[i - 1]).norm(), 0.02f);
  EXPECT_EQ(shapes.reason, "too many poses: the path is thinned out");
}

/// Bounds of a body's points.
Eigen::AlignedBox3f boundsOf(const render::Body& body) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : body.points) box.extend(p);
  return box;
}

TEST(PathConversion, putsArrowsOfRVizsSizeAlongThePoses) {
  PathStyle style;
  style.poses = PathStyle::Poses::Arrows;
  auto message = path({{1, 2, 3}});
  message.poses[0].pose.orientation.z = message.poses[0].pose.orientation.w = std::sqrt(0.5);
  const auto shapes = toPathShapes(message, style);  // looks along y
  ASSERT_TRUE(shapes.value->glyphs);
  EXPECT_TRUE(shapes.value->glyphs->colors.empty());
  const auto box = boundsOf(*shapes.value->glyphs);
  EXPECT_LT((box.min() - Eigen::Vector3f(0.85f, 2, 2.85f)).norm(), 2e-3f);
  EXPECT_LT((box.max() - Eigen::Vector3f(1.15f, 2.3f, 3.15f)).norm(), 2e-3f);
}

TEST(PathConversion, putsAxesOfRVizsSizeAndColorsAtThePoses) {
  PathStyle style;
  style.poses = PathStyle::Poses::Axes;
  const auto shapes = toPathShapes(path({{0, 0, 0}, {5, 0, 0}}), style);  // no rotation: identity
  ASSERT_TRUE(shapes.value->glyphs);
  const render::Body& body = *shapes.value->glyphs;
  const auto box = boundsOf(body);
  EXPECT_LT((box.min() - Eigen::Vector3f(-0.015f, -0.015f, -0.015f)).norm(), 2e-3f);
  EXPECT_LT((box.max() - Eigen::Vector3f(5.3f, 0.3f, 0.3f)).norm(), 2e-3f);
  ASSERT_EQ(body.colors.size(), body.points.size());
  for (std::size_t i = 0; i < body.points.size(); ++i) {
    const Eigen::Vector3f p = body.points[i];
    if (p.z() > 0.02f) {
      ASSERT_EQ(body.colors[i], (render::Color{0, 0, 1, 1}));
    }
    if (p.y() > 0.02f) {
      ASSERT_EQ(body.colors[i], (render::Color{0, 1, 0, 1}));
    }
  }
}

TEST(PathConversion, leavesOutGlyphsOfBadPosesAndOfTooMany) {
  PathStyle style;
  style.poses = PathStyle::Poses::Arrows;
  auto message = path(std::vector<Eigen::Vector3d>(3, {0, 0, 0}));
  message.poses[0].pose.orientation.w = std::nan("");
  message.poses[1].pose.orientation.w = 2;
  const auto shapes = toPathShapes(message, style);
  EXPECT_EQ(shapes.reason,
            "a pose's orientation is not finite; a pose's orientation is not normalized");
  const auto one = toPathShapes(path({{0, 0, 0}}), style).value->glyphs->points.size();
  EXPECT_EQ(shapes.value->glyphs->points.size(), 2 * one);
  const auto many =
      toPathShapes(path(std::vector<Eigen::Vector3d>(kMostGlyphs + 1, {0, 0, 0})), style);
  EXPECT_EQ(many.value->glyphs->points.size(), (kMostGlyphs / 2 + 1) * one);
  EXPECT_EQ(many.reason, "too many poses: some have no axes or arrow");
}

}  // namespace
}  // namespace afterglow::nodes::path_and_scan_conversion_test
