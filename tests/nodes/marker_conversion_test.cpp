#include "nodes/conversion/marker_conversion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace afterglow::nodes::marker_conversion_test {
namespace {

using visualization_msgs::Marker;

geometry_msgs::Point point(double x, double y, double z) {
  geometry_msgs::Point p;
  p.x = x;
  p.y = y;
  p.z = z;
  return p;
}

std_msgs::ColorRGBA color(float r, float g, float b, float a) {
  std_msgs::ColorRGBA c;
  c.r = r;
  c.g = g;
  c.b = b;
  c.a = a;
  return c;
}

Marker marker(int type, int points = 0) {
  Marker m;
  m.type = type;
  m.pose.orientation.w = 1;
  m.scale.x = 0.4;
  m.scale.y = 0.2;
  m.scale.z = 0.2;
  m.color = color(0, 1, 0, 1);
  for (int i = 0; i < points; ++i) m.points.push_back(point(i, 0.5 * i * i, 0));
  return m;
}

Converted<render::Drawable> toDrawable(const Marker& m) {
  MarkerAssets assets;
  return nodes::toDrawable(m, assets);
}

template <typename Shape>
Shape shapeOf(const Marker& m) {
  const auto drawable = toDrawable(m);
  EXPECT_TRUE(drawable.value.has_value()) << drawable.reason;
  return drawable.value ? std::get<Shape>(drawable.value->shape) : Shape{};
}

std::string reasonFor(const Marker& m) {
  const auto drawable = toDrawable(m);
  EXPECT_FALSE(drawable.value.has_value());
  return drawable.reason;
}

TEST(MarkerConversion, drawsAnArrowAlongX) {
  const auto arrow = shapeOf<render::Arrow>(marker(Marker::ARROW));
  EXPECT_FLOAT_EQ(arrow.length, 0.4f);
  EXPECT_FLOAT_EQ(arrow.shaft_diameter, 0.2f);
  EXPECT_FLOAT_EQ(arrow.head_diameter, 0.4f);
  EXPECT_FLOAT_EQ(arrow.head_length, 0.23f * 0.4f);
}

TEST(MarkerConversion, drawsAnArrowWithAnEllipticSectionAsTriangles) {
  Marker m = marker(Marker::ARROW);
  m.scale.z = 0.1;
  const auto arrow = shapeOf<render::Triangles>(m);
  Eigen::AlignedBox3f box;
  for (const auto& p : arrow.points) box.extend(p);
  EXPECT_EQ(arrow.points.size() % 3, 0u);
  EXPECT_TRUE(box.min().isApprox(Eigen::Vector3f(0, -0.2f, -0.1f), 1e-5f)) << box.min();
  EXPECT_TRUE(box.max().isApprox(Eigen::Vector3f(0.4f, 0.2f, 0.1f), 1e-5f)) << box.max();
}

TEST(MarkerConversion, drawsAnArrowBetweenTwoPoints) {
  Marker m = marker(Marker::ARROW);
  m.points = {point(1, 2, 3), point(1, 2, 1)};
  m.scale.x = 0.02;
  m.scale.y = 0.05;
  m.scale.z = 0;
  const auto drawable = toDrawable(m);
  ASSERT_TRUE(drawable.value);
  const auto arrow = std::get<render::Arrow>(drawable.value->shape);
  EXPECT_FLOAT_EQ(arrow.length, 2);
  EXPECT_FLOAT_EQ(arrow.shaft_diameter, 0.02f);
  EXPECT_FLOAT_EQ(arrow.head_diameter, 0.05f);
  EXPECT_FLOAT_EQ(arrow.head_length, 0.46f);
  const Eigen::Vector3d tip = drawable.value->pose * Eigen::Vector3d(2, 0, 0);
  EXPECT_LT((tip - Eigen::Vector3d(1, 2, 1)).norm(), 1e-9) << tip;
}

TEST(MarkerConversion, keepsAnArrowsHeadWithinItsLength) {
  Marker m = marker(Marker::ARROW);
  m.points = {point(0, 0, 0), point(0.1, 0, 0)};
  m.scale.z = 5;
  EXPECT_FLOAT_EQ(shapeOf<render::Arrow>(m).head_length, 0.1f);
}

TEST(MarkerConversion, refusesArrowsThatAreNone) {
  EXPECT_EQ(reasonFor(marker(Marker::ARROW, 1)), "ARROW of neither 0 nor 2 points");
  EXPECT_EQ(reasonFor(marker(Marker::ARROW, 3)), "ARROW of neither 0 nor 2 points");
  Marker m = marker(Marker::ARROW);
  m.points = {point(1, 1, 1), point(1, 1, 1)};
  EXPECT_EQ(reasonFor(m), "arrow's start and end coincide");
  m = marker(Marker::ARROW);
  m.scale.x = 0;
  EXPECT_EQ(reasonFor(m), "arrow's length or width is not positive");
}

TEST(MarkerConversion, drawsSolidsOfFullSizeInTheirPose) {
  Marker m = marker(Marker::CUBE);
  m.pose.position.x = 3;
  m.pose.orientation.w = m.pose.orientation.z = std::sqrt(0.5);
  const auto drawable = toDrawable(m);
  ASSERT_TRUE(drawable.value);
  EXPECT_EQ(std::get<render::Cube>(drawable.value->shape).size, Eigen::Vector3f(0.4f, 0.2f, 0.2f));
  EXPECT_EQ(drawable.value->color, (render::Color{0, 1, 0, 1}));
  const Eigen::Vector3d corner = drawable.value->pose * Eigen::Vector3d(1, 0, 0);
  EXPECT_LT((corner - Eigen::Vector3d(3, 1, 0)).norm(), 1e-9);
  EXPECT_EQ(shapeOf<render::Sphere>(marker(Marker::SPHERE)).size.x(), 0.4f);
  EXPECT_EQ(shapeOf<render::Cylinder>(marker(Marker::CYLINDER)).size.z(), 0.2f);
}

TEST(MarkerConversion, drawsFlatAndMirroredSolidsButNoLines) {
  Marker m = marker(Marker::CUBE);
  m.scale.z = 0;
  m.scale.x = -0.4;
  const auto cube = shapeOf<render::Cube>(m);
  EXPECT_EQ(cube.size.x(), 0.4f);
  EXPECT_GT(cube.size.z(), 0);
  EXPECT_LT(cube.size.z(), 1e-5f);
  m.scale.y = 0;
  EXPECT_EQ(reasonFor(m), "scale is 0");
}

TEST(MarkerConversion, drawsLists) {
  const auto strip = shapeOf<render::Lines>(marker(Marker::LINE_STRIP, 3));
  EXPECT_TRUE(strip.strip);
  EXPECT_EQ(strip.points.size(), 3u);
  EXPECT_FLOAT_EQ(strip.width, 0.4f);
  EXPECT_FALSE(shapeOf<render::Lines>(marker(Marker::LINE_LIST, 4)).strip);
  EXPECT_EQ(shapeOf<render::ShapeList>(marker(Marker::CUBE_LIST, 2)).kind,
            render::ShapeList::Kind::Cubes);
  EXPECT_EQ(shapeOf<render::ShapeList>(marker(Marker::SPHERE_LIST, 2)).kind,
            render::ShapeList::Kind::Spheres);
  const auto squares = shapeOf<render::PointCloud>(marker(Marker::POINTS, 2));
  EXPECT_EQ(squares.style, render::PointStyle::Squares);
  EXPECT_FLOAT_EQ(squares.size, 0.4f);
  EXPECT_FLOAT_EQ(squares.size_y, 0.2f);
  const auto triangles = shapeOf<render::Triangles>(marker(Marker::TRIANGLE_LIST, 3));
  EXPECT_EQ(triangles.points[2], Eigen::Vector3f(0.8f, 0.4f, 0));  // scale multiplies
}

TEST(MarkerConversion, refusesNumbersOfPointsThatMakeNoPrimitives) {
  EXPECT_EQ(reasonFor(marker(Marker::LINE_STRIP, 1)), "fewer than two points for a line");
  EXPECT_EQ(reasonFor(marker(Marker::LINE_LIST, 3)), "LINE_LIST of an odd number of points");
  EXPECT_EQ(reasonFor(marker(Marker::TRIANGLE_LIST, 4)), "TRIANGLE_LIST of incomplete triangles");
  for (const int type :
       {Marker::CUBE_LIST, Marker::SPHERE_LIST, Marker::POINTS, Marker::TRIANGLE_LIST}) {
    EXPECT_EQ(reasonFor(marker(type, 0)), "no points") << type;
  }
}

TEST(MarkerConversion, takesColorsAPointOrAFaceAndRefusesOtherNumbers) {
  Marker m = marker(Marker::POINTS, 4);
  m.color.a = 0;  // replaced altogether by the points' colors
  m.colors.assign(4, color(1, 0, 0, 0.5f));
  const auto drawable = toDrawable(m);
  ASSERT_TRUE(drawable.value) << drawable.reason;
  EXPECT_EQ(drawable.value->color, render::Color{});
  EXPECT_EQ(std::get<render::PointCloud>(drawable.value->shape).colors.at(3),
            (render::Rgba{255, 0, 0, 128}));
  for (const std::size_t count : {1u, 3u, 5u}) {
    m.colors.resize(count);
    EXPECT_EQ(reasonFor(m), "colors are not as many as points") << count;
  }
  m = marker(Marker::TRIANGLE_LIST, 6);
  m.colors.assign(2, color(1, 0, 0, 1));
  EXPECT_EQ(shapeOf<render::Triangles>(m).colors.size(), 2u);
}

TEST(MarkerConversion, clampsColors) {
  Marker m = marker(Marker::CUBE);
  m.color = color(255, -1, 0.5f, 255);
  EXPECT_EQ(toDrawable(m).value->color, (render::Color{1, 0, 0.5f, 1}));
}

TEST(MarkerConversion, takesAnAllZeroQuaternionForTheIdentity) {
  Marker m = marker(Marker::CUBE);
  m.pose.orientation.w = 0;
  EXPECT_TRUE(toDrawable(m).value->pose.matrix().linear().isIdentity());
}

TEST(MarkerConversion, normalizesOrientationsAndRemarksOnOddOnes) {
  Marker m = marker(Marker::CUBE);
  m.pose.orientation.w = 1.005;
  EXPECT_EQ(toDrawable(m).reason, "");
  m.pose.orientation.w = 3;
  const auto drawable = toDrawable(m);
  ASSERT_TRUE(drawable.value);
  EXPECT_TRUE(drawable.value->pose.matrix().linear().isIdentity(1e-12));
  EXPECT_EQ(drawable.reason, "orientation is not normalized");
  m.pose.orientation.w = 1e-9;
  EXPECT_EQ(reasonFor(m), "orientation has no length");
}

TEST(MarkerConversion, refusesEverythingThatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Marker m = marker(Marker::CUBE);
  m.pose.position.y = nan;
  EXPECT_EQ(reasonFor(m), "position is not finite or absurdly far");
  m = marker(Marker::CUBE);
  m.pose.orientation.x = std::numeric_limits<double>::infinity();
  EXPECT_EQ(reasonFor(m), "orientation is not finite");
  m = marker(Marker::CUBE);
  m.scale.y = 6e180;
  EXPECT_EQ(reasonFor(m), "scale is not finite or absurdly large");
  m = marker(Marker::CUBE);
  m.color.g = static_cast<float>(nan);
  EXPECT_EQ(reasonFor(m), "color is not finite");
  m = marker(Marker::POINTS, 3);
  m.points[1].z = 1e245;
  EXPECT_EQ(reasonFor(m), "a point is not finite or absurdly far");
  m = marker(Marker::POINTS, 3);
  m.colors.assign(3, color(1, 1, 1, static_cast<float>(nan)));
  EXPECT_EQ(reasonFor(m), "a color is not finite");
}

TEST(MarkerConversion, refusesTypesItDoesNotDraw) {
  EXPECT_EQ(reasonFor(marker(99)), "unknown type");
  EXPECT_EQ(reasonFor(marker(-1)), "unknown type");
}

}  // namespace
}  // namespace afterglow::nodes::marker_conversion_test
