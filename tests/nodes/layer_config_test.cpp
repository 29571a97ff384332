#include "nodes/projector/layer_config.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "nodes/projector/projector_config.hpp"

namespace afterglow::nodes::layer_config_test {
namespace {

const std::string kCloud = "topic: /c, type: sensor_msgs/PointCloud2, ";
const std::string kScan = "topic: /s, type: sensor_msgs/LaserScan, ";
const std::string kPath = "topic: /p, type: nav_msgs/Path, ";

LayerConfig load(const std::string& keys) {
  const YamlMap map("file", YAML::Load("{" + keys + "}"), "layer 1", kLayerKeys);
  return readLayerConfig(map, {});
}

std::string fault(const std::string& keys) {
  try {
    load(keys);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no fault";
}

TEST(LayerColor, mayBeASourceByName) {
  EXPECT_EQ(load(kCloud + "color: mono8").cloud.color, ColorSource::Mono8);
  EXPECT_EQ(load(kCloud + "color: rgbf32").cloud.color, ColorSource::RgbF32);
  EXPECT_EQ(load(kCloud + "color: {by: rgb8}").cloud.color, ColorSource::Rgb8);
  EXPECT_EQ(load(kScan + "color: axis_x").cloud.color, ColorSource::AxisX);
  EXPECT_EQ(load(kCloud).cloud.color, ColorSource::Flat);
  EXPECT_EQ(fault(kScan + "color: mono8"), "file:1: sensor_msgs/LaserScan has no color 'mono8'");
}

TEST(LayerColor, saysHowIntensitiesBecomeColors) {
  const CloudStyle rainbow =
      load(kCloud + "color: {by: intensity, channel: ring, invert: true, min: 0, max: 4096}").cloud;
  EXPECT_EQ(rainbow.color, ColorSource::Intensity);
  EXPECT_EQ(rainbow.channel, "ring");
  EXPECT_TRUE(rainbow.scale.rainbow);
  EXPECT_TRUE(rainbow.scale.invert);
  EXPECT_EQ(rainbow.scale.bounds, (std::array<double, 2>{0, 4096}));
  const CloudStyle two_colors = load(kScan +
                                     "color: {by: intensity, rainbow: false,"
                                     " min_color: \"#ff0000\", max_color: [0, 255, 0]}")
                                    .cloud;
  EXPECT_FALSE(two_colors.scale.rainbow);
  EXPECT_EQ(two_colors.scale.least, (render::Color{1, 0, 0, 1}));
  EXPECT_EQ(two_colors.scale.greatest, (render::Color{0, 1, 0, 1}));
  EXPECT_FALSE(two_colors.scale.bounds);
}

TEST(LayerColor, saysWhichAxisOfWhichFrameAndItsBounds) {
  const CloudStyle style =
      load(kCloud + "color: {by: axis_y, min: -1, max: 2, fixed_frame: false}").cloud;
  EXPECT_EQ(style.color, ColorSource::AxisY);
  EXPECT_EQ(style.scale.bounds, (std::array<double, 2>{-1, 2}));
  EXPECT_FALSE(style.axis_of_fixed_frame);
  EXPECT_TRUE(load(kCloud + "color: axis_y").cloud.axis_of_fixed_frame);
}

TEST(LayerColor, refusesKeysWithoutMeaningAndHalfABound) {
  const std::string where = " in the color of layer 1 has no meaning ";
  EXPECT_EQ(fault(kCloud + "color: {by: axis_z, invert: true}"),
            "file:1: 'invert'" + where + "without intensity");
  EXPECT_EQ(fault(kCloud + "color: {by: rgb8, min: 0, max: 1}"),
            "file:1: 'min'" + where + "for rgb8");
  EXPECT_EQ(fault(kCloud + "color: {by: intensity, fixed_frame: true}"),
            "file:1: 'fixed_frame'" + where + "without an axis");
  EXPECT_EQ(fault(kCloud + "color: {by: intensity, max_color: \"#ffffff\"}"),
            "file:1: 'max_color'" + where + "with rainbow");
  EXPECT_EQ(fault(kCloud + "color: {by: intensity, rainbow: false, invert: true}"),
            "file:1: 'invert'" + where + "without rainbow");
  EXPECT_EQ(fault(kScan + "color: {by: intensity, channel: ring}"),
            "file:1: 'channel'" + where + "for sensor_msgs/LaserScan");
  EXPECT_EQ(fault(kCloud + "color: {by: intensity, min: 3}"),
            "file:1: 'min' and 'max' of the color of layer 1 go together");
  EXPECT_EQ(fault(kCloud + "color: {by: axis_z, min: 3, max: 2}"),
            "file:1: 'max' of the color of layer 1 should be a number from 3 to 1e+12, not '2'");
  EXPECT_EQ(fault(kCloud + "color: {by: axis_w}"),
            "file:1: unknown by 'axis_w' in the color of layer 1; did you mean 'axis_x'?");
  EXPECT_EQ(fault(kCloud + "color: {by: intensity, rainbow: false, min_color: red}"),
            "file:1: 'min_color' of the color of layer 1 should be \"#rrggbb\" or [r, g, b]");
  EXPECT_EQ(fault(kPath + "color: {by: axis_z}"), "file:1: nav_msgs/Path has no color 'axis_z'");
}

TEST(LayerDecay, isInSeconds) {
  EXPECT_EQ(load(kCloud + "decay: 2.5").decay_ns, 2'500'000'000);
  EXPECT_EQ(load(kScan).decay_ns, 0);
  EXPECT_EQ(fault(kPath + "decay: 1"),
            "file:1: 'decay' in layer 1 has no meaning for nav_msgs/Path");
  EXPECT_EQ(fault(kCloud + "decay: -1"),
            "file:1: 'decay' of layer 1 should be a number from 0 to 86400, not '-1'");
}

TEST(LayerPath, hasRVizsSizesUnlessToldOtherwise) {
  const LayerConfig plain = load(kPath);
  EXPECT_EQ(plain.path.line, PathStyle::Line::Billboards);
  EXPECT_EQ(plain.path.width, 0.03f);
  EXPECT_EQ(plain.path.poses, PathStyle::Poses::None);
  EXPECT_EQ(plain.buffer_length, 1);
  EXPECT_EQ(load(kPath + "style: lines").path.width, 1);  // pixels
  const PathStyle axes = load(kPath + "pose_style: axes, axes: {diameter: 0.01}").path;
  EXPECT_EQ(axes.axes_length, 0.3f);
  EXPECT_EQ(axes.axes_diameter, 0.01f);
  const PathStyle arrows =
      load(kPath + "pose_style: arrows, arrows: {shaft_length: 0.5, color: [255, 0, 0]}").path;
  EXPECT_FLOAT_EQ(arrows.arrow.length, 0.7f);
  EXPECT_EQ(arrows.arrow.head_length, 0.2f);
  EXPECT_EQ(arrows.arrow_color, (render::Color{1, 0, 0, 1}));
}

TEST(LayerPath, readsBufferLengthAndOffset) {
  const LayerConfig config = load(kPath + "buffer_length: 3, offset: [0, 0, 0.1]");
  EXPECT_EQ(config.buffer_length, 3);
  EXPECT_EQ(config.offset, Eigen::Vector3d(0, 0, 0.1));
  EXPECT_EQ(fault(kPath + "buffer_length: 2.5"), "file:1: 'buffer_length' of layer 1 counts paths");
  EXPECT_EQ(fault(kPath + "offset: [0, 1e9, 0]"), "file:1: 'offset' of layer 1 is absurdly far");
}

TEST(LayerPath, refusesKeysWithoutMeaning) {
  EXPECT_EQ(fault(kPath + "axes: {length: 1}"),
            "file:1: 'axes' in layer 1 has no meaning without pose_style axes");
  EXPECT_EQ(fault(kPath + "pose_style: arrows, arrows: {radius: 1}"),
            "file:1: unknown key 'radius' in the arrows of layer 1; known: color, shaft_length, "
            "shaft_diameter, head_length, head_diameter");
  EXPECT_EQ(fault(kCloud + "offset: [0, 0, 0]"),
            "file:1: 'offset' in layer 1 has no meaning for sensor_msgs/PointCloud2");
  EXPECT_EQ(fault(kPath + "pose_style: arrow"),
            "file:1: unknown pose_style 'arrow' in layer 1; did you mean 'arrows'?");
}

TEST(LayerFloor, hasRVizsSizesAndColorsUnlessToldOtherwise) {
  const LayerConfig pose = load("topic: /p, type: geometry_msgs/PoseStamped");
  EXPECT_EQ(pose.path.poses, PathStyle::Poses::Arrows);
  EXPECT_FLOAT_EQ(pose.path.arrow.length, 1.3f);
  EXPECT_EQ(pose.path.arrow.shaft_diameter, 0.05f);
  EXPECT_EQ(pose.path.arrow_color, (render::Color{1, 25 / 255.0f, 0, 1}));
  const LayerConfig array = load("topic: /p, type: geometry_msgs/PoseArray, arrows: {length: 0.5}");
  EXPECT_EQ(array.path.poses, PathStyle::Poses::FlatArrows);
  EXPECT_EQ(array.path.flat_arrow_length, 0.5f);
  EXPECT_EQ(load("topic: /m, type: nav_msgs/OccupancyGrid").alpha, 0.7f);
  EXPECT_EQ(load("topic: /r, type: sensor_msgs/Range").alpha, 0.5f);
  EXPECT_EQ(load("topic: /o, type: nav_msgs/Odometry").buffer_length, 100);
}

TEST(LayerFloor, isToldByRVizsOptions) {
  EXPECT_EQ(load("topic: /m, type: nav_msgs/OccupancyGrid, color_scheme: costmap").color_scheme,
            ColorScheme::Costmap);
  EXPECT_EQ(load("topic: /m, type: nav_msgs/OccupancyGrid").secondTopic(), "/m_updates");
  EXPECT_TRUE(load("topic: /f, type: geometry_msgs/PolygonStamped, style: filled").filled);
  const std::string odometry = "topic: /o, type: nav_msgs/Odometry, ";
  const LayerConfig trail = load(odometry +
                                 "keep: 5, position_tolerance: 1, angle_tolerance: 0.5, "
                                 "shape: axes, axes: {length: 0.2}, covariance: "
                                 "{position: {scale: 2, alpha: 1}, orientation: false}");
  EXPECT_EQ(trail.buffer_length, 5);
  EXPECT_EQ(trail.position_tolerance, 1);
  EXPECT_EQ(trail.path.poses, PathStyle::Poses::Axes);
  EXPECT_EQ(trail.covariance.position_scale, 2);
  EXPECT_EQ(trail.covariance.position_color.a, 1);
  EXPECT_TRUE(trail.covariance.has_position);
  EXPECT_FALSE(trail.covariance.has_orientation);
  EXPECT_FALSE(load(odometry + "covariance: false").covariance.has_position);
  const LayerConfig image =
      load("topic: /i, type: sensor_msgs/Image, camera_info: /info, distance: 2");
  EXPECT_EQ(image.secondTopic(), "/info");
  EXPECT_EQ(image.image.distance, 2);
}

TEST(LayerFloor, refusesKeysWithoutMeaning) {
  EXPECT_EQ(fault("topic: /m, type: nav_msgs/OccupancyGrid, color: [1, 2, 3]"),
            "file:1: 'color' in layer 1 has no meaning for nav_msgs/OccupancyGrid");
  EXPECT_EQ(fault(kPath + "shape: axes"),
            "file:1: 'shape' in layer 1 has no meaning for nav_msgs/Path");
  EXPECT_EQ(fault("topic: /f, type: geometry_msgs/PolygonStamped, style: filled, size: 1"),
            "file:1: 'size' in layer 1 has no meaning with style filled");
  EXPECT_EQ(fault("topic: /p, type: geometry_msgs/PoseStamped, shape: flat_arrow"),
            "file:1: unknown shape 'flat_arrow' in layer 1; known: axes, arrow");
  EXPECT_EQ(fault("topic: /p, type: geometry_msgs/PoseStamped, axes: {length: 1}"),
            "file:1: 'axes' in layer 1 has no meaning without shape axes");
  EXPECT_EQ(fault("topic: /p, type: geometry_msgs/PoseArray, shape: arrow, size: 1"),
            "file:1: 'size' in layer 1 has no meaning without shape flat_arrow");
  EXPECT_EQ(fault("topic: /i, type: sensor_msgs/Image, camera_info: /info, size: 2"),
            "file:1: 'size' in layer 1 has no meaning with camera_info");
  EXPECT_EQ(fault("topic: /i, type: sensor_msgs/Image, distance: 2"),
            "file:1: 'distance' in layer 1 has no meaning without camera_info");
  EXPECT_EQ(fault("topic: /i, type: sensor_msgs/Image, camera_info: info"),
            "file:1: 'camera_info' of layer 1 is a topic: it should begin with '/'");
  EXPECT_EQ(fault("topic: /o, type: nav_msgs/Odometry, keep: 0"),
            "file:1: 'keep' of layer 1 should be a number from 1 to 1000, not '0'");
}

}  // namespace
}  // namespace afterglow::nodes::layer_config_test
