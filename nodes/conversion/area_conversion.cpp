#include "nodes/conversion/area_conversion.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <utility>

#include "render/scene/solids.hpp"
#include "render/scene/triangulate.hpp"

namespace afterglow::nodes {
namespace {

const char kFarPoint[] = "a point is not finite or absurdly far";

Converted<Drawables> one(render::Shape shape, const render::Color& color) {
  return {Drawables{{{}, std::move(shape), color}}, {}};
}

Converted<Drawables> one(render::Body body, const render::Color& color) {
  render::MeshInstance mesh;
  mesh.body = std::make_shared<const render::Body>(std::move(body));
  return one(render::Shape(std::move(mesh)), color);
}

/// Twice the area, along the normal (Newell); the length of each is the polygon's in a plane.
Eigen::Vector3d areaOf(const render::PointList& points) {
  Eigen::Vector3d area = Eigen::Vector3d::Zero();
  const Eigen::Vector3d first = points.front().cast<double>();
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    area += (points[i].cast<double>() - first).cross(points[i + 1].cast<double>() - first);
  }
  return area;
}

Converted<Drawables> toFace(render::PointList points, const render::Color& color) {
  if (points.size() > kMostFilledCorners) {
    return refused<Drawables>("more than 1000 corners to be filled");
  }
  const Eigen::Vector3d area = areaOf(points);
  if (!(area.norm() > 1e-9)) return refused<Drawables>("a polygon without an area");
  const Eigen::Matrix3d R =
      Eigen::Quaterniond::FromTwoVectors(area, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  render::Outline outline;
  for (const Eigen::Vector3f& p : points) outline.push_back((R * p.cast<double>()).head<2>());
  render::Body body;
  body.triangles = render::triangulate(outline, {});
  body.points = std::move(points);
  return one(std::move(body), color);
}

/// Begins half-way, so that all corners are joined.
render::PointList closedLine(const render::PointList& points) {
  render::PointList line;
  const Eigen::Vector3f half = 0.5f * (points.front() + points.back());
  line.push_back(half);
  line.insert(line.end(), points.begin(), points.end());
  line.push_back(half);
  return line;
}

}  // namespace

Converted<Drawables> toPolygonShapes(const geometry_msgs::Polygon& polygon, const PathStyle& style,
                                     bool filled, const render::Color& color) {
  if (polygon.points.size() > kMostPathPoints) return refused<Drawables>("too many points");
  render::PointList points;
  for (const geometry_msgs::Point32& p : polygon.points) {
    const auto point = toVector(double{p.x}, double{p.y}, double{p.z});
    if (!point) return refused<Drawables>(kFarPoint);
    if (points.empty() || points.back() != *point) points.push_back(*point);
  }
  if (points.size() > 1 && points.back() == points.front()) points.pop_back();
  if (points.size() < 2) return {Drawables(), {}};
  if (filled) return toFace(std::move(points), color);
  return one(styledLine(closedLine(points), style), color);
}

Converted<Drawables> toCellShapes(const nav_msgs::GridCells& message, const render::Color& color) {
  if (message.cells.empty()) return {Drawables(), {}};
  if (message.cells.size() > kMostGridCells) return refused<Drawables>("more than 524288 cells");
  const auto size = toVector(double{message.cell_width}, double{message.cell_height}, 0);
  if (!size || !(size->head<2>().minCoeff() > 0)) {
    return refused<Drawables>("cell_width or cell_height is not positive");
  }
  render::Body body;
  body.points.reserve(4 * message.cells.size());
  body.triangles.reserve(2 * message.cells.size());
  for (const geometry_msgs::Point& cell : message.cells) {
    const auto center = toVector(cell.x, cell.y, cell.z);
    if (!center) return refused<Drawables>(kFarPoint);
    const auto first = static_cast<std::uint32_t>(body.points.size());
    for (const auto& [x, y] :
         {std::pair(-0.5f, -0.5f), {0.5f, -0.5f}, {0.5f, 0.5f}, {-0.5f, 0.5f}}) {
      body.points.push_back(*center + Eigen::Vector3f(x * size->x(), y * size->y(), 0));
    }
    body.triangles.push_back({first, first + 1, first + 2});
    body.triangles.push_back({first, first + 2, first + 3});
  }
  return one(std::move(body), color);
}

Converted<Drawables> toConeShapes(const sensor_msgs::Range& message, const render::Color& color) {
  const double least = double{message.min_range}, greatest = double{message.max_range};
  const double said = double{message.range}, view = double{message.field_of_view};
  const bool is_near = least == greatest && said < 0 && std::isinf(said);
  const double range = is_near ? least : said;
  if (!(range >= least && range <= greatest) || !(range > 0)) return {Drawables(), {}};
  if (!(view > 0 && view < M_PI)) return refused<Drawables>("field_of_view is not within 0 and pi");
  const double width = 2 * range * std::tan(view / 2);
  if (!toVector(range, width, 0)) return refused<Drawables>("range is absurdly far");
  Eigen::Affine3d tip_at_sensor = Eigen::Affine3d::Identity();
  tip_at_sensor.translation().x() = range;
  tip_at_sensor.linear() = Eigen::Vector3d(-range, -width, width).asDiagonal();
  render::Body body;
  addSolid(render::unitCone(48), tip_at_sensor, body);
  body.is_closed = true;
  return one(std::move(body), color);
}

}  // namespace afterglow::nodes
