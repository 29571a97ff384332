#include "nodes/conversion/cloud_conversion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace afterglow::nodes::cloud_color_test {
namespace {

TEST(CloudColor, followsAnAxisOfTheFixedFrame) {
  render::PointCloud cloud;
  cloud.points = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  Eigen::Isometry3d T_fixed_cloud = Eigen::Isometry3d::Identity();
  T_fixed_cloud.rotate(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY()));  // z points down
  colorByAxis(cloud, {2, {}}, T_fixed_cloud);
  EXPECT_EQ(cloud.colors.front(), (render::Rgba{255, 0, 255, 255}));
  EXPECT_EQ(cloud.colors.back(), (render::Rgba{255, 0, 0, 255}));
}

TEST(CloudColor, weighsTheLuminanceOfGrays) {
  EXPECT_EQ(gray({1, 0, 0, 0.5f}), (render::Color{0.2989f, 0.2989f, 0.2989f, 0.5f}));
  EXPECT_EQ(gray({0, 1, 0, 1}).g, 0.5870f);
  EXPECT_EQ(gray({0, 0, 1, 1}).b, 0.1140f);
}

TEST(ColorScale, colorsEqualAndUnusableValuesRed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(colorsOf({5, 5}, {})[1], (render::Color{1, 0, 0, 1}));
  EXPECT_EQ(colorsOf({nan, 1, 2}, {})[0], (render::Color{1, 0, 0, 1}));
  EXPECT_EQ(colorsOf({nan, 1, 2}, {})[2], (render::Color{1, 0, 1, 1}));
  EXPECT_EQ(colorsOf({-1.7e308, 1.7e308}, {})[1], (render::Color{1, 0, 1, 1}));
}

TEST(ColorScale, holdsValuesWithinFixedBounds) {
  ColorScale scale;
  scale.bounds = {0, 4096};
  const auto colors = colorsOf({-5, 2048, 1e9}, scale);
  EXPECT_EQ(colors[0], (render::Color{1, 0, 0, 1}));
  EXPECT_EQ(colors[1], (render::Color{0, 1, 0.5f, 1}));
  EXPECT_EQ(colors[2], (render::Color{1, 0, 1, 1}));
  scale.bounds = {7, 7};
  EXPECT_EQ(colorsOf({1, 9}, scale), render::ColorList(2, {1, 0, 0, 1}));
}

TEST(ColorScale, turnsTheRainbowAround) {
  ColorScale scale;
  scale.invert = true;
  EXPECT_EQ(colorsOf({1, 2}, scale)[0], (render::Color{1, 0, 1, 1}));
  EXPECT_EQ(colorsOf({1, 2}, scale)[1], (render::Color{1, 0, 0, 1}));
  EXPECT_EQ(colorsOf({1, 1}, scale)[0], (render::Color{1, 0, 1, 1}));
}

TEST(ColorScale, blendsBetweenTwoColorsWithoutRainbow) {
  ColorScale scale;
  scale.rainbow = false;
  EXPECT_EQ(colorsOf({0, 1, 4}, scale)[1], (render::Color{0.25f, 0.25f, 0.25f, 1}));
  scale.least = {1, 0, 0, 1};
  scale.greatest = {0, 1, 0, 1};
  EXPECT_EQ(colorsOf({0, 1, 4}, scale)[1], (render::Color{0.75f, 0.25f, 0, 1}));
  EXPECT_EQ(colorsOf({3, 3}, scale)[0], scale.least);
}

}  // namespace
}  // namespace afterglow::nodes::cloud_color_test
