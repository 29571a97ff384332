// Polygons, poses, cells, ranges, maps and images, from messages to pictures of both back ends.
#include <gtest/gtest.h>
#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <cstdlib>

#include "nodes/projector/projector_scene.hpp"
#include "render/projector_renderer.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/golden.hpp"
#include "tests/support/image_measures.hpp"

namespace afterglow::nodes::floor_layers_gl_test {
namespace {

ros::Time now() { return ros::Time(1000); }

std_msgs::Header inMap() {
  std_msgs::Header header;
  header.frame_id = "map";
  header.stamp = now();
  return header;
}

geometry_msgs::Pose pose(double x, double y, double yaw) {
  geometry_msgs::Pose pose;
  pose.position.x = x;
  pose.position.y = y;
  pose.orientation.z = std::sin(yaw / 2);
  pose.orientation.w = std::cos(yaw / 2);
  return pose;
}

geometry_msgs::PolygonStamped star(double x, double y) {
  geometry_msgs::PolygonStamped message;
  message.header = inMap();
  for (int i = 0; i < 10; ++i) {
    geometry_msgs::Point32 p;
    const double angle = i * M_PI / 5, radius = i % 2 == 0 ? 0.5 : 0.2;
    p.x = static_cast<float>(x + radius * std::cos(angle));
    p.y = static_cast<float>(y + radius * std::sin(angle));
    message.polygon.points.push_back(p);
  }
  return message;
}

/// A layer of its own for every message; all lie on a floor.
class FloorLayers : public test::GlTest {
 protected:
  template <typename Message>
  void show(const Message& message, const std::string& keys = "") {
    show(std::vector<Message>{message}, keys);
  }
  template <typename Message>
  void show(const std::vector<Message>& messages, const std::string& keys) {
    SurfaceConfig floor;
    floor.name = floor.frame = "map";
    const std::string text = std::string("{topic: /layer, placement: drape, surface: map, type: ") +
                             ros::message_traits::DataType<Message>::value() +
                             (keys.empty() ? "" : ", ") + keys + "}";
    ProjectorConfig config;
    config.fixed_frame = "map";
    config.surfaces = {floor};
    config.layers = {
        readLayerConfig(YamlMap("file", YAML::Load(text), "layer 1", kLayerKeys), config.surfaces)};
    tf2::BufferCore buffer;
    ProjectorScene scene(config, buffer);
    for (const Message& message : messages) scene.add(0, message, now());
    const render::Scene shown = scene.snapshot(now()).scene;
    EXPECT_TRUE(scene.status()[0].dropped.empty()) << scene.status()[0].dropped.begin()->first;
    all_.layers.push_back(shown.layers.at(0));
  }

  /// Looks down on 3.4 m of floor; the image is kept, and OpenGL's is the same but at edges.
  void expectGolden(const std::string& name) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
    T.translation().z() = 3;
    const Rigid<Projector, World> pose(T);
    test::expectGolden("tests/nodes/goldens/" + name + ".png", all_, pose);
    const render::Image cpu = test::painted(all_, pose);
    const render::Image gl =
        render::ProjectorRenderer(context(), test::goldenLens(), render::Drawing::Gl)
            .render(all_, pose);
    ASSERT_EQ(gl.rgb.size(), cpu.rgb.size());
    double sum = 0;
    for (std::size_t i = 0; i < gl.rgb.size(); ++i) sum += std::abs(gl.rgb[i] - cpu.rgb[i]);
    EXPECT_LT(sum / static_cast<double>(gl.rgb.size()), 1.5);
    EXPECT_TRUE(render::isLit(gl));
  }

  /// Where rectangles meet, along edges and at corners, nothing shines through.
  void expectNoLines(int least) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal() *
                 Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
    T.translation().z() = 3;
    const Rigid<Projector, World> pose(T);
    const render::Image image = test::painted(all_, pose);
    int darkest = 255;
    for (int v = 45; v < 75; ++v) {
      for (int u = 60; u < 100; ++u) {
        for (int i = 0; i < 3; ++i) darkest = std::min<int>(darkest, test::pixelAt(image, u, v)[i]);
      }
    }
    EXPECT_GE(darkest, least);
  }

 private:
  render::Scene all_;
};

TEST_F(FloorLayers, ofPolygons) {
  show(star(-0.9, 0.5));
  show(star(0.4, 0.5), "style: filled, color: [255, 0, 0]");
  show(star(-0.9, -0.6), "style: lines, size: 1, color: [0, 255, 255]");
  jsk_recognition_msgs::PolygonArray array;
  array.polygons = {star(0.4, -0.6), star(1.1, -0.6)};
  show(array, "style: filled, alpha: 0.5");
  expectGolden("polygons");
}

TEST_F(FloorLayers, ofPoses) {
  geometry_msgs::PoseStamped one;
  one.header = inMap();
  one.pose = pose(-1.4, 0.9, -0.3);
  show(one);
  one.pose = pose(0.6, 0.6, 0.4);
  show(one, "shape: axes, axes: {length: 0.5}");
  geometry_msgs::PoseArray array;
  array.header = inMap();
  for (int i = 0; i < 6; ++i) array.poses.push_back(pose(-1.4 + 0.35 * i, 0.1, i));
  show(array);
  for (geometry_msgs::Pose& p : array.poses) p.position.x += 0.4, p.position.y -= 0.5;
  show(array, "shape: arrow, color: [0, 255, 0]");
  geometry_msgs::PoseWithCovarianceStamped spread;
  spread.header = inMap();
  spread.pose.pose = pose(0, -0.8, 0.2);
  spread.pose.covariance[0] = 0.09;
  spread.pose.covariance[1] = spread.pose.covariance[6] = 0.03;
  spread.pose.covariance[7] = 0.04;
  spread.pose.covariance[35] = 0.04;
  show(spread);
  std::vector<nav_msgs::Odometry> way(8);
  for (int i = 0; i < 8; ++i) {
    way[static_cast<std::size_t>(i)].header = inMap();
    way[static_cast<std::size_t>(i)].pose.pose = pose(-1.5 + 0.06 * i, -0.9, 0.05 * i);
  }
  show(way, "arrows: {shaft_length: 0.1, head_length: 0.05}, color: [0, 0, 255]");
  expectGolden("poses");
}

TEST_F(FloorLayers, ofCellsAndRanges) {
  nav_msgs::GridCells cells;
  cells.header = inMap();
  cells.cell_width = 0.2f;
  cells.cell_height = 0.1f;
  for (int i = 0; i < 12; ++i) {
    geometry_msgs::Point p;
    p.x = -1.2 + 0.2 * (i % 4) + 0.05 * (i / 4);
    p.y = 0.6 - 0.1 * (i / 4);
    cells.cells.push_back(p);
  }
  show(cells);
  sensor_msgs::Range range;
  range.header = inMap();
  range.field_of_view = 0.6f;
  range.min_range = 0.1f;
  range.max_range = 3;
  range.range = 1.2f;
  show(range);
  expectGolden("cells");
}

TEST_F(FloorLayers, ofMapsInAllColorSchemes) {
  nav_msgs::OccupancyGrid map;
  map.header = inMap();
  map.info.width = map.info.height = 12;
  map.info.resolution = 0.08f;
  map.info.origin = pose(-1.5, -0.2, 0.2);
  map.data.assign(144, -1);
  for (std::size_t i = 0; i < 100; ++i) map.data[i + 12] = static_cast<std::int8_t>(i);
  map.data[130] = 100;
  map.data[131] = 120;
  map.data[132] = -50;
  show(map, "alpha: 1");
  map.info.origin = pose(-0.3, 0, 0);
  show(map, "color_scheme: costmap");
  map.info.origin = pose(0.8, 0, 0);
  show(map, "color_scheme: raw");
  expectGolden("maps");
}

TEST_F(FloorLayers, ofAnImageThatLiesOnTheFloor) {
  sensor_msgs::Image image;
  image.header.frame_id = "camera";
  image.width = 24;
  image.height = 16;
  image.step = 72;
  image.encoding = sensor_msgs::image_encodings::RGB8;
  for (int i = 0; i < 24 * 16; ++i) {
    const int x = i % 24, y = i / 24;
    const bool is_top_left = x < 6 && y < 4;
    for (const int value : {10 * x, 15 * y, is_top_left ? 255 : 0}) {
      image.data.push_back(static_cast<std::uint8_t>(value));
    }
  }
  show(image, "size: 2.4, offset: [-0.2, 0.1, 0]");
  expectGolden("image");
}

/// A quarter of them true.
std::vector<bool> noise() {
  std::vector<bool> all;
  std::uint32_t random = 1;
  for (int i = 0; i < 60 * 60; ++i) {
    random = random * 1664525u + 1013904223u;
    all.push_back(random >> 30 == 0);
  }
  return all;
}

TEST_F(FloorLayers, ofImagesHaveNoLinesBetweenTheirPixels) {
  sensor_msgs::Image image;
  image.header.frame_id = "camera";
  image.width = image.height = image.step = 60;
  image.encoding = sensor_msgs::image_encodings::MONO8;
  for (const bool is_darker : noise()) image.data.push_back(is_darker ? 252 : 255);
  show(image, "size: 3");
  expectNoLines(250);
}

TEST_F(FloorLayers, ofMapsHaveNoLinesBetweenTheirCells) {
  nav_msgs::OccupancyGrid map;
  map.header = inMap();
  map.info.width = map.info.height = 60;
  map.info.resolution = 0.05f;
  map.info.origin = pose(-1.5, -1.5, 0);
  for (const bool is_darker : noise()) map.data.push_back(is_darker ? 1 : 0);
  show(map, "alpha: 1");
  expectNoLines(250);
}

}  // namespace
}  // namespace afterglow::nodes::floor_layers_gl_test
