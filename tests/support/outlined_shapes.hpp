/// \file
/// One of every kind of shape, some centimeters large, and points whose hull it fills.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <memory>
#include <vector>

#include "render/scene/closed_body.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::test {

using Points = std::vector<Eigen::Vector3d>;

/// A shape and what it is the union of: convex bodies' points, in its own coordinates.
struct OutlinedShape {
  render::Shape shape;
  std::vector<Points> bodies;
  bool lies_flat = false;  ///< along the surface's axes, whatever its pose; for drape
};

inline Points boxAt(const Eigen::Vector3d& center, const Eigen::Vector3d& size) {
  Points points;
  for (int i = 0; i < 8; ++i) {
    points.emplace_back(center +
                        Eigen::Vector3d(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5)
                            .cwiseProduct(size));
  }
  return points;
}

inline Points ballAt(const Eigen::Vector3d& center, const Eigen::Vector3d& size) {
  Points points;
  for (int i = 0; i <= 120; ++i) {
    for (int j = 0; j < 240; ++j) {
      const double a = M_PI * i / 120, b = 2 * M_PI * j / 240;
      const Eigen::Vector3d p(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
      points.push_back(center + p.cwiseProduct(size) / 2);
    }
  }
  return points;
}

/// A ring across an axis: 0 around x, 2 around z.
inline void addRing(Points& points, int axis, double at, double diameter) {
  for (int i = 0; i < 360; ++i) {
    const double u = diameter / 2 * std::cos(M_PI * i / 180);
    const double v = diameter / 2 * std::sin(M_PI * i / 180);
    points.push_back(axis == 0 ? Eigen::Vector3d(at, u, v) : Eigen::Vector3d(u, v, at));
  }
}

inline Points tube(int axis, double from, double to, double diameter) {
  Points points;
  addRing(points, axis, from, diameter);
  addRing(points, axis, to, diameter);
  return points;
}

inline std::vector<OutlinedShape> solidShapes() {
  std::vector<OutlinedShape> items;
  items.push_back({render::Cube{{0.06f, 0.05f, 0.03f}}, {boxAt({0, 0, 0}, {0.06, 0.05, 0.03})}});
  items.push_back({render::Sphere{{0.06f, 0.05f, 0.04f}}, {ballAt({0, 0, 0}, {0.06, 0.05, 0.04})}});
  items.push_back({render::Cylinder{{0.05f, 0.05f, 0.04f}}, {tube(2, -0.02, 0.02, 0.05)}});
  Points head = tube(0, 0.055, 0.055, 0.045);
  head.emplace_back(0.075, 0, 0);
  items.push_back({render::Arrow{0.075f, 0.024f, 0.045f, 0.02f}, {tube(0, 0, 0.055, 0.024), head}});
  const render::PointList two = {{-0.024f, 0, 0}, {0.024f, 0.01f, 0.01f}};
  const Eigen::Vector3d a = two[0].cast<double>(), b = two[1].cast<double>();
  const Eigen::Vector3d size(0.025, 0.03, 0.02), large(0.04, 0.04, 0.04);
  items.push_back({render::ShapeList{render::ShapeList::Kind::Cubes, two, {}, size.cast<float>()},
                   {boxAt(a, size), boxAt(b, size)}});
  items.push_back(
      {render::ShapeList{render::ShapeList::Kind::Spheres, two, {}, large.cast<float>()},
       {ballAt(a, large), ballAt(b, large)}});
  const Points triangle = {{-0.03, -0.02, 0}, {0.03, -0.025, 0.01}, {0, 0.03, -0.01}};
  render::PointList corners;
  for (const Eigen::Vector3d& p : triangle) corners.push_back(p.cast<float>());
  items.push_back({render::Triangles{corners, {}}, {triangle}});
  render::PointCloud cloud;
  cloud.points = two;
  cloud.size = 0.04f;
  cloud.style = render::PointStyle::Boxes;
  items.push_back({cloud, {boxAt(a, large), boxAt(b, large)}});
  cloud.style = render::PointStyle::Spheres;
  items.push_back({cloud, {ballAt(a, large), ballAt(b, large)}});
  auto body = std::make_shared<render::Body>();
  body->points = {{-0.5f, -0.3f, 0}, {0.5f, -0.5f, 0.2f}, {0.4f, 0.5f, 0}, {-0.5f, 0.4f, 0.1f}};
  body->triangles = {{0, 1, 2}, {0, 2, 3}};
  Points sheet;
  for (const Eigen::Vector3f& p : body->points) sheet.push_back(p.cast<double>() * 0.06);
  items.push_back({render::MeshInstance{body, {0.06f, 0.06f, 0.06f}, false}, {sheet}});
  auto closed = std::make_shared<render::Body>();
  closed->points = {{-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0, 0.5f, 0}, {0.2f, 0, 1}};
  closed->triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  render::findWhetherClosed(*closed);
  Points pyramid;
  for (const Eigen::Vector3f& p : closed->points) pyramid.push_back(p.cast<double>() * 0.06);
  items.push_back({render::MeshInstance{closed, {0.06f, 0.06f, 0.06f}, false}, {pyramid}});
  return items;
}

inline std::vector<OutlinedShape> flatShapes() {
  std::vector<OutlinedShape> items;
  render::Lines lines;
  lines.points = {{-0.03f, -0.02f, 0}, {0.03f, 0.02f, 0}};
  lines.width = 0.024f;
  const Eigen::Vector3d along(0.03, 0.02, 0),
      across = Eigen::Vector3d(-2, 3, 0).normalized() * 0.012;
  const Points bar = {-along - across, -along + across, along + across, along - across};
  items.push_back({lines, {bar}, true});
  lines.strip = false;
  items.push_back({lines, {bar}, true});
  for (const render::PointStyle style :
       {render::PointStyle::Squares, render::PointStyle::FlatSquares}) {
    render::PointCloud cloud;
    cloud.points = {{0, 0, 0}};
    cloud.size = 0.05f;
    cloud.size_y = 0.03f;
    cloud.style = style;
    items.push_back({cloud, {boxAt({0, 0, 0}, {0.05, 0.03, 0})}, true});
  }
  return items;
}

}  // namespace afterglow::test
