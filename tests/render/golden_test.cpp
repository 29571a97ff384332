// Small images that were looked at and are kept in goldens/: what is drawn stays what it was.
#include <gtest/gtest.h>

#include "tests/support/golden.hpp"

namespace afterglow::render::golden_test {
namespace {

void expectGolden(const std::string& name, const Scene& scene) {
  test::expectGolden("tests/render/goldens/" + name + ".png", scene);
}

Rigid<World, World> at(int column, int row, double angle = 0.8) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0.3 * (column - 1.5), 0.3 * (row - 1), 1.2;
  T.rotate(Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 0.5).normalized()));
  return Rigid<World, World>(T);
}

const ColorList kColors = {{1, 0.2f, 0.2f, 1}, {0.2f, 1, 0.2f, 1}, {0.3f, 0.4f, 1, 1}};

/// A letter L, 0.14 high.
SharedBody letter() {
  Body body;
  body.points = {{-0.05f, -0.07f, 0}, {0.05f, -0.07f, 0}, {0.05f, -0.04f, 0},
                 {-0.02f, -0.04f, 0}, {-0.02f, 0.07f, 0}, {-0.05f, 0.07f, 0}};
  body.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}};
  return std::make_shared<const Body>(body);
}

SharedBody tetrahedron() {
  Body body;
  body.points = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  body.colors = {kColors[0], kColors[1], kColors[2], {1, 1, 1, 1}};
  body.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  return std::make_shared<const Body>(body);
}

/// One of each marker type.
std::vector<Drawable> markers() {
  const Eigen::Vector3f size(0.2f, 0.14f, 0.1f);
  const PointList points = {{-0.07f, 0.05f, 0}, {0.06f, 0.06f, 0.01f}, {0.02f, -0.08f, 0.02f}};
  const PointList pairs = {points[0], points[1], points[2], -points[2]};
  PointCloud squares;
  squares.points = points;
  squares.colors = asBytes(kColors);
  squares.style = PointStyle::Squares;
  squares.size = 0.06f;
  squares.size_y = 0.03f;
  const std::vector<Shape> shapes = {
      Arrow{0.2f, 0.03f, 0.07f, 0.07f},
      Cube{size},
      Sphere{size},
      Cylinder{size},
      Lines{points, kColors, 0.02f, true},
      Lines{pairs, {}, 0.015f, false},
      ShapeList{ShapeList::Kind::Cubes, points, kColors, 0.4f * size},
      ShapeList{ShapeList::Kind::Spheres, points, {}, 0.4f * size},
      squares,
      Text{letter()},
      MeshInstance{tetrahedron(), Eigen::Vector3f::Constant(0.06f), true},
      Triangles{points, kColors},
  };
  std::vector<Drawable> all;
  for (int i = 0; i < static_cast<int>(shapes.size()); ++i) {
    all.push_back({at(i % 4, i / 4), shapes[static_cast<std::size_t>(i)], {1, 0.8f, 0.2f, 1}});
  }
  all[1].color.a = 0.5f;
  return all;
}

TEST(Golden, everyMarkerType) {
  Layer layer;
  layer.drawables = markers();
  expectGolden("markers", {{layer}, {}});
}

TEST(Golden, everyCloudStyle) {
  Layer layer;
  for (int style = 0; style < 5; ++style) {
    PointCloud cloud;
    PointList points;
    ColorList colors;
    for (int i = 0; i < 36; ++i) {
      const float x = static_cast<float>(i % 6) - 2.5f, y = static_cast<float>(i / 6) - 2.5f;
      points.emplace_back(0.04f * x, 0.04f * y, 0);
      colors.push_back({0.5f + 0.2f * x, 0.5f + 0.2f * y, 0.5f - 0.2f * x, 1});
    }
    cloud.points = std::move(points);
    cloud.colors = asBytes(colors);
    cloud.style = static_cast<PointStyle>(style);
    cloud.size = style == 0 ? 3 : 0.03f;
    layer.drawables.push_back(
        {at(style % 3, style / 3, 0.3), cloud, {1, 1, 1, style == 4 ? 0.5f : 1}});
  }
  expectGolden("clouds", {{layer}, {}});
}

TEST(Golden, markersLaidOnASurfaceWithAnOutline) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = 1.4;
  T.rotate(Eigen::AngleAxisd(M_PI - 0.4, Eigen::Vector3d::UnitX()));
  Layer layer;
  layer.drawables = markers();
  layer.placement = Placement::Drape;
  layer.surface = SurfacePatch{
      "table", Rigid<World, Surface>(T), {{-0.6, -0.5}, {0.55, -0.4}, {0.4, 0.3}, {-0.1, 0.45}}};
  expectGolden("draped", {{layer}, {}});
}

}  // namespace
}  // namespace afterglow::render::golden_test
