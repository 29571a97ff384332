// Clouds, scans and paths over time: what decays, what is buffered, what is seen from a moving
// robot.
#include "nodes/projector/layer_state.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/projector/projector_scene.hpp"
#include "tests/support/cloud_messages.hpp"

namespace afterglow::nodes::layer_content_test {
namespace {

using test::cloudMessage;

ros::Time at(double seconds) { return ros::Time(1000 + seconds); }

/// One layer on a hand-driven clock and hand-made transforms.
class LayerContentTest : public ::testing::Test {
 protected:
  template <typename Message>
  void add(const Message& message, double now) {
    if (!scene) {
      ProjectorConfig config;
      config.fixed_frame = "map";
      layer.topic = "/layer";
      config.layers = {layer};
      scene.emplace(config, buffer);
    }
    scene->add(0, message, at(now));
  }

  void transform(double stamp, double x, double yaw = 0) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation().x() = x;
    T.rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
    geometry_msgs::TransformStamped message;
    message.header.frame_id = "map";
    message.header.stamp = at(stamp);
    message.child_frame_id = "laser";
    message.transform = toTransform(T);
    buffer.setTransform(message, "test", false);
  }

  std::vector<render::Drawable> drawn(double now) {
    std::vector<std::string> problems;
    return scene->snapshot(at(now)).scene.layers.at(0).drawables;
  }
  /// All points of all clouds, in the fixed frame.
  std::vector<Eigen::Vector3d> points(double now) {
    std::vector<Eigen::Vector3d> all;
    for (const render::Drawable& drawable : drawn(now)) {
      const auto& cloud = std::get<render::PointCloud>(drawable.shape);
      for (const Eigen::Vector3f& p : cloud.points) {
        all.push_back(drawable.pose.matrix() * p.cast<double>());
      }
    }
    return all;
  }
  LayerStatus status() { return scene->status().at(0); }

  LayerConfig layer;
  tf2::BufferCore buffer;
  std::optional<ProjectorScene> scene;
};

// ------------------------------------------------------------------------------------------ clouds
TEST_F(LayerContentTest, keepsCloudsUntilTheyDecay) {
  layer.type = LayerType::PointCloud2;
  layer.decay_ns = 2'000'000'000;
  add(cloudMessage("map", {{1, 0, 0}}), 0);
  add(cloudMessage("map", {{2, 0, 0}}), 1);
  EXPECT_EQ(points(1.9).size(), 2u);
  ASSERT_EQ(points(2).size(), 1u);  // as RViz: at the moment itself it is gone
  EXPECT_EQ(points(2)[0].x(), 2);
  add(sensor_msgs::PointCloud2(), 2.5);  // takes nothing away before its time
  EXPECT_EQ(points(2.5).size(), 1u);
  EXPECT_TRUE(points(3).empty());
}

TEST_F(LayerContentTest, countsDecayFromWhenACloudIsPlaced) {
  layer.type = LayerType::PointCloud2;
  layer.decay_ns = 1'000'000'000;
  auto message = cloudMessage("laser", {{1, 0, 0}});
  message.header.stamp = at(0);
  add(message, 0);
  EXPECT_TRUE(points(1.5).empty());  // waits for its transform
  transform(0, 0);
  EXPECT_EQ(points(1.6).size(), 1u);
  EXPECT_EQ(points(2.5).size(), 1u);
  EXPECT_TRUE(points(2.6).empty());
}

TEST_F(LayerContentTest, boundsThePointsOfAllCloudsThatDecay) {
  layer.type = LayerType::PointCloud2;
  layer.decay_ns = 3'600'000'000'000;
  std::vector<Eigen::Vector3f> many(kMostCloudPoints, {1, 1, 1});
  auto message = cloudMessage("map", many);
  for (int i = 0; i < 6; ++i) add(message, i);
  EXPECT_EQ(drawn(6).size(), 4u);
  EXPECT_EQ(status().remarks.at("too many points: what was shown longest is left out"), 2u);
}

TEST_F(LayerContentTest, clearsOnACloudOfNothingThatCanBeSeen) {
  layer.type = LayerType::PointCloud2;
  add(cloudMessage("map", {{1, 0, 0}}), 0);
  EXPECT_EQ(points(0).size(), 1u);
  auto blind = cloudMessage("map", {{std::numeric_limits<float>::quiet_NaN(), 0, 0}});
  blind.is_dense = 1;
  add(blind, 1);
  EXPECT_TRUE(drawn(1).empty());
  EXPECT_TRUE(status().dropped.empty());
}

TEST_F(LayerContentTest, colorsAnAxisOfTheCloudsOwnFrameIfToldSo) {
  layer.type = LayerType::PointCloud2;
  layer.cloud.color = ColorSource::AxisX;
  layer.cloud.axis_of_fixed_frame = false;
  transform(0, 0, M_PI);  // in the fixed frame x runs the other way
  add(cloudMessage("laser", {{1, 0, 0}, {2, 0, 0}}), 0);
  const auto own = std::get<render::PointCloud>(drawn(0).at(0).shape);
  EXPECT_EQ(own.colors[0], (render::Rgba{255, 0, 0, 255}));
  scene.reset();
  layer.cloud.axis_of_fixed_frame = true;
  add(cloudMessage("laser", {{1, 0, 0}, {2, 0, 0}}), 0);
  const auto fixed = std::get<render::PointCloud>(drawn(0).at(0).shape);
  EXPECT_EQ(fixed.colors[0], (render::Rgba{255, 0, 255, 255}));
}

TEST_F(LayerContentTest, multipliesAPointsAlphaByItsLayers) {
  layer.type = LayerType::PointCloud2;
  layer.alpha = 0.5f;
  layer.cloud.color = ColorSource::Rgb8;
  auto message = cloudMessage("map", {{1, 0, 0}}, 16);
  message.fields.push_back(message.fields[0]);
  message.fields[3].name = "rgba";
  message.fields[3].offset = 12;
  message.data[15] = 51;
  add(message, 0);
  const render::Drawable drawable = drawn(0).at(0);
  EXPECT_EQ(drawable.color, (render::Color{1, 1, 1, 0.5f}));
  EXPECT_EQ(std::get<render::PointCloud>(drawable.shape).colors[0].a, 51);
}

TEST_F(LayerContentTest, drawsTheSamePointsInEveryFrameWithoutACopy) {
  layer.type = LayerType::PointCloud2;
  add(cloudMessage("map", {{1, 0, 0}}), 0);
  const auto first = drawn(0), second = drawn(1);
  EXPECT_EQ(std::get<render::PointCloud>(first[0].shape).points.get().data(),
            std::get<render::PointCloud>(second[0].shape).points.get().data());
}

// ------------------------------------------------------------------------------------------- scans
/// Rays straight ahead (x), `seconds` apart, each returning from `range`.
sensor_msgs::LaserScan ahead(std::size_t rays, float seconds, float range) {
  sensor_msgs::LaserScan message;
  message.header.frame_id = "laser";
  message.header.stamp = at(0);
  message.time_increment = seconds;
  message.range_max = 100;
  message.ranges.assign(rays, range);
  return message;
}

TEST_F(LayerContentTest, putsEachRayOfAMovingScannerWhereItWasSeen) {
  layer.type = LayerType::LaserScan;
  // Turns 90 degrees while it drives 1 m, with a pause in between.
  const auto share = [](int i) { return i <= 3 ? i / 6.0 : i <= 5 ? 0.5 : (i - 2) / 6.0; };
  for (int i = 0; i <= 8; ++i) transform(0.125 * i, share(i), share(i) * M_PI / 2);
  add(ahead(9, 0.125f, 2), 1);
  const auto seen = points(1);
  ASSERT_EQ(seen.size(), 9u);
  for (int i = 0; i <= 8; ++i) {
    const double yaw = share(i) * M_PI / 2;
    const Eigen::Vector3d expected(share(i) + 2 * std::cos(yaw), 2 * std::sin(yaw), 0);
    // Its stops lie between the poses that are asked for.
    EXPECT_LT((seen[static_cast<std::size_t>(i)] - expected).norm(), 0.01) << i;
  }
}

TEST_F(LayerContentTest, takesAllRaysForTheStampsWithoutTimesOfTheirOwn) {
  layer.type = LayerType::LaserScan;
  transform(0, 0);
  transform(1, 1);
  add(ahead(11, 0, 2), 1);
  for (const Eigen::Vector3d& p : points(1)) EXPECT_DOUBLE_EQ(p.x(), 2);
}

TEST_F(LayerContentTest, waitsForTheTransformOfTheLastRay) {
  layer.type = LayerType::LaserScan;
  transform(0, 0);
  transform(0.9, 0.9);
  auto message = ahead(9, 0.125f, 2);
  message.ranges.back() = std::numeric_limits<float>::quiet_NaN();  // it did not return
  add(message, 1);
  EXPECT_TRUE(drawn(1).empty());
  EXPECT_EQ(status().waiting_for, "laser");
  transform(1, 1);
  const auto seen = points(1.1);
  ASSERT_EQ(seen.size(), 8u);
  EXPECT_NEAR(seen[0].x(), 2, 1e-5);
  EXPECT_NEAR(seen[7].x(), 2.875, 1e-5);
}

TEST_F(LayerContentTest, seesAScannerThatCountsBackwards) {
  layer.type = LayerType::LaserScan;
  transform(-1, -1);
  transform(0, 0);
  add(ahead(9, -0.125f, 2), 0);
  const auto seen = points(0);
  ASSERT_EQ(seen.size(), 9u);
  EXPECT_NEAR(seen[0].x(), 2, 1e-5);
  EXPECT_NEAR(seen[8].x(), 1, 1e-5);
}

TEST_F(LayerContentTest, bearsScansAtTheEndsOfTime) {
  layer.type = LayerType::LaserScan;
  transform(0, 0);
  auto message = ahead(2, 1, 2);
  message.header.stamp = ros::Time(0xffffffffu, 999'999'999u);
  add(message, 0);
  message.time_increment = -1;
  message.header.stamp = ros::Time(0, 1);
  add(message, 0);
  EXPECT_TRUE(drawn(0).empty());
  scene->update(at(11));
  ASSERT_EQ(status().dropped.size(), 2u);
  for (const auto& [reason, count] : status().dropped) {
    EXPECT_EQ(reason.substr(0, 8), "stamped ") << reason;
  }
}

// tf2_ros::MessageFilter drops them; it has no words for it.
TEST_F(LayerContentTest, tellsByHowMuchAStampIsOffAndTheWayOut) {
  layer.type = LayerType::PointCloud2;
  const std::string way_out = "set its sender's clock by tf's (chrony, ntp), or stamp it 0";
  const std::map<double, std::string> words = {
      {30, "stamped 30 s after it came, ahead of tf: " + way_out},
      {-30, "stamped 30 s before it came, older than what tf has (10 s at most): " + way_out}};
  for (const auto& [skew, reason] : words) {
    scene.reset();
    buffer.clear();
    transform(0, 1);
    auto message = cloudMessage("laser", {{1, 0, 0}});
    message.header.stamp = at(skew);
    add(message, 0);
    EXPECT_EQ(scene->snapshot(at(0)).problems.back(), "/layer: " + reason);
    EXPECT_EQ(status().missing, reason);
    for (int i = 1; i < 20; ++i) {  // more than wait
      transform(0.1 * i, 1);
      message.header.stamp = at(skew + 0.1 * i);
      add(message, 0.1 * i);
    }
    EXPECT_EQ(status().dropped.at("too many waiting: " + reason), 10u);
    for (int i = 2; i < 15; ++i) transform(i, 1);
    scene->update(at(14));
    EXPECT_EQ(status().dropped.at(reason), 10u);
    EXPECT_TRUE(drawn(14).empty());
  }
}

TEST_F(LayerContentTest, tellsTheSkewOfPathsAndScansButBlamesNoStampForAFrameThatIsMissing) {
  layer.type = LayerType::Path;
  transform(0, 1);
  nav_msgs::Path path;
  path.header.frame_id = "laser";
  path.header.stamp = at(3600);
  path.poses.resize(2);
  path.poses[1].pose.position.x = 1;
  add(path, 0);
  scene->snapshot(at(0));
  EXPECT_EQ(status().missing.substr(0, 28), "stamped 3600 s after it came");
  scene.reset();
  path.header.frame_id = "nowhere";
  add(path, 0);
  scene->snapshot(at(0));
  EXPECT_EQ(status().missing, "no transform from 'nowhere' to 'map'");
  scene.reset();
  layer.type = LayerType::LaserScan;
  auto message = ahead(3, 0, 2);
  message.header.stamp = at(-12);
  add(message, 0);
  scene->snapshot(at(0));
  EXPECT_EQ(status().missing.substr(0, 27), "stamped 12 s before it came");
}

TEST_F(LayerContentTest, tellsWhyTheNewestMessageShowsNothing) {
  layer.type = LayerType::Path;
  nav_msgs::Path path;
  path.header.frame_id = "map";
  const auto nothingOf = [&](std::size_t poses) {
    path.poses.resize(poses);
    add(path, 0);
    return status().nothing;
  };
  EXPECT_EQ(nothingOf(0), "a path without poses");
  EXPECT_EQ(nothingOf(1), "a path of one pose");
  EXPECT_EQ(nothingOf(2), "a path without two poses apart");
  path.poses[1].pose.position.x = 1;
  EXPECT_EQ(nothingOf(2), "");
  scene.reset();
  layer.type = LayerType::PointCloud2;
  add(sensor_msgs::PointCloud2(), 0);
  EXPECT_EQ(status().nothing, "a cloud without points");
  add(cloudMessage("map", {{std::numeric_limits<float>::quiet_NaN(), 0, 0}}), 0);
  EXPECT_EQ(status().nothing, "a cloud whose points are not finite");
  scene.reset();
  layer.type = LayerType::LaserScan;
  auto blind = ahead(2, 0, 2);
  blind.header.frame_id = "map";
  blind.ranges.assign(2, std::numeric_limits<float>::infinity());
  add(blind, 0);
  EXPECT_EQ(status().nothing, "a scan without a return");
}

// ------------------------------------------------------------------------------------------- paths
nav_msgs::Path pathTo(double x) {
  nav_msgs::Path path;
  path.header.frame_id = "map";
  path.poses.resize(2);
  path.poses[1].pose.position.x = x;
  return path;
}

TEST_F(LayerContentTest, keepsTheLastPathsOfItsBuffer) {
  layer.type = LayerType::Path;
  layer.buffer_length = 2;
  for (const double x : {1, 2, 3}) add(pathTo(x), x);
  auto lines = drawn(3);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(std::get<render::Lines>(lines[0].shape).points[1].x(), 3);
  EXPECT_EQ(std::get<render::Lines>(lines[1].shape).points[1].x(), 2);
  add(nav_msgs::Path(), 4);  // an empty one takes the place of the oldest
  lines = drawn(4);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(std::get<render::Lines>(lines[0].shape).points[1].x(), 3);
}

TEST_F(LayerContentTest, shiftsAPathInTheFixedFrame) {
  layer.type = LayerType::Path;
  layer.offset = {1, 0, 0.25};
  transform(0, 7, M_PI);
  nav_msgs::Path path = pathTo(1);
  path.header.frame_id = "laser";
  add(path, 0);
  EXPECT_EQ(drawn(0).at(0).pose.matrix().translation(), Eigen::Vector3d(8, 0, 0.25));
}

TEST_F(LayerContentTest, drawsAPathsLineAndItsArrows) {
  layer.type = LayerType::Path;
  layer.flat_color = {0, 1, 0, 1};
  layer.path.poses = PathStyle::Poses::Arrows;
  add(pathTo(1), 0);
  const auto shapes = drawn(0);
  ASSERT_EQ(shapes.size(), 2u);
  EXPECT_EQ(shapes[0].color, (render::Color{0, 1, 0, 1}));
  EXPECT_EQ(shapes[1].color, layer.path.arrow_color);
  EXPECT_FALSE(std::get<render::MeshInstance>(shapes[1].shape).own_colors);
  add(pathTo(0), 1);  // no line: both poses are one; arrows all the same
  EXPECT_EQ(drawn(1).size(), 1u);
}

}  // namespace
}  // namespace afterglow::nodes::layer_content_test
