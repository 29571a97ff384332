#include "nodes/conversion/path_conversion.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "render/scene/tessellate.hpp"
#include "render/scene/triangulate.hpp"

namespace afterglow::nodes {

void addSolid(const render::Solid& solid, const Eigen::Affine3d& placed, render::Body& body) {
  const auto first = static_cast<std::uint32_t>(body.points.size());
  for (const Eigen::Vector3d& p : solid.points) body.points.push_back((placed * p).cast<float>());
  for (const auto& t : solid.triangles) {
    body.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
}

namespace {

/// A unit cylinder laid along axis 0, 1 or 2, from `begin` on.
Eigen::Affine3d rod(int axis, double begin, double length, double diameter) {
  Eigen::Matrix3d R;  // the cylinder's z becomes the axis
  R.col(2) = Eigen::Vector3d::Unit(axis);
  R.col(0) = Eigen::Vector3d::Unit((axis + 1) % 3);
  R.col(1) = Eigen::Vector3d::Unit((axis + 2) % 3);
  Eigen::Affine3d placed = Eigen::Affine3d::Identity();
  placed.linear() = R * Eigen::Vector3d(diameter, diameter, length).asDiagonal();
  placed.translation() = (begin + length / 2) * Eigen::Vector3d::Unit(axis);
  return placed;
}

/// Cylinders from the pose along x (red), y (green) and z (blue), as RViz 1.14's Axes.
void addAxes(const Eigen::Isometry3d& pose, float length, float diameter, render::Body& body) {
  for (int axis = 0; axis < 3; ++axis) {
    addSolid(render::unitCylinder(24), pose * rod(axis, 0, length, diameter), body);
    body.colors.resize(body.points.size(),
                       {axis == 0 ? 1.f : 0.f, axis == 1 ? 1.f : 0.f, axis == 2 ? 1.f : 0.f, 1});
  }
}

/// Adds an arrow from the pose along x, as RViz 1.14's Arrow, without colors.
void addArrow(const Eigen::Isometry3d& pose, const render::Arrow& arrow, render::Body& body) {
  const double shaft = arrow.length - arrow.head_length, D = arrow.head_diameter;
  addSolid(render::unitCylinder(24), pose * rod(0, 0, shaft, arrow.shaft_diameter), body);
  Eigen::Affine3d head = Eigen::Affine3d::Identity();
  head.linear() = Eigen::Vector3d(arrow.head_length, D, D).asDiagonal();
  head.translation().x() = shaft;
  addSolid(render::unitCone(24), pose * head, body);
}

/// A head without a shaft's end: the pairs of points of RViz's "Arrow (Flat)".
void addFlatArrow(const Eigen::Isometry3d& pose, double length, render::PointList& pairs) {
  const auto at = [&](double x, double y) {
    return Eigen::Vector3f((pose * Eigen::Vector3d(x * length, y * length, 0)).cast<float>());
  };
  for (const Eigen::Vector3f& p :
       {at(0, 0), at(1, 0), at(1, 0), at(0.75, 0.2), at(1, 0), at(0.75, -0.2)}) {
    pairs.push_back(p);
  }
}

/// The glyphs of poses; of more than kMostGlyphs every second, third, ... Solids or pairs of
/// points.
struct Glyphs {
  render::Body solids;
  render::PointList pairs;
};

Glyphs glyphsAt(const std::vector<geometry_msgs::Pose>& poses, const PathStyle& style,
                std::set<std::string>& remarks) {
  Glyphs glyphs;
  const std::size_t stride = (poses.size() + kMostGlyphs - 1) / kMostGlyphs;
  if (stride > 1) remarks.insert("too many poses: some have no axes or arrow");
  for (std::size_t i = 0; i < poses.size(); i += stride) {
    const auto pose = toPose(poses[i]);
    if (!pose.reason.empty()) remarks.insert("a pose's " + pose.reason);
    if (!pose.value) continue;
    if (style.poses == PathStyle::Poses::Axes) {
      addAxes(*pose.value, style.axes_length, style.axes_diameter, glyphs.solids);
    } else if (style.poses == PathStyle::Poses::Arrows) {
      addArrow(*pose.value, style.arrow, glyphs.solids);
    } else {
      addFlatArrow(*pose.value, double{style.flat_arrow_length}, glyphs.pairs);
    }
  }
  glyphs.solids.is_closed = true;  // all of them are
  return glyphs;
}

std::string joined(const std::set<std::string>& remarks) {
  return fmt::format("{}", fmt::join(remarks, "; "));
}

constexpr float kFinestSpacing = 0.001f;   // m; about a pixel at a projector's usual distance
constexpr std::size_t kMostStrips = 1000;  // each is thinned out to a point at worst

/// Converts one path.
class PathReader {
 public:
  PathReader(const nav_msgs::Path& message, const PathStyle& style)
      : message_(message), style_(style), frame_(frameName(message.header.frame_id)) {}

  Converted<PathShapes> read() {
    readStrips();
    thinOut();
    for (render::PointList& strip : strips_) addLines(std::move(strip));
    if (style_.poses != PathStyle::Poses::None) addGlyphs();
    return {std::move(shapes_), joined(remarks_)};
  }

 private:
  void readStrips() {
    bool is_broken = true;
    for (const geometry_msgs::PoseStamped& pose : message_.poses) {
      const std::string& frame = pose.header.frame_id;
      if (!frame.empty() && frame != message_.header.frame_id && frameName(frame) != frame_) {
        remarks_.insert("a pose names another frame than its path, whose frame counts");
      }
      const geometry_msgs::Point& position = pose.pose.position;
      const auto point = toVector(position.x, position.y, position.z);
      if (!point) {
        remarks_.insert("a pose is not finite or absurdly far: the line breaks there");
      } else if (is_broken) {
        if (strips_.size() >= kMostStrips) {
          remarks_.insert("too many breaks: the rest of the path is left out");
          return;
        }
        strips_.push_back({*point});
      } else if (strips_.back().back() != *point) {
        strips_.back().push_back(*point);
      }
      is_broken = !point;
    }
  }

  /// Keeps points that are some way from the last one kept: what is left out is as near to the
  /// line.
  void thinOut() {
    const auto size = [this] {
      std::size_t sum = 0;
      for (const render::PointList& strip : strips_) sum += strip.size();
      return sum;
    };
    for (float spacing = kFinestSpacing; size() > kMostPathPoints; spacing *= 2) {
      remarks_.insert("too many poses: the path is thinned out");
      for (render::PointList& strip : strips_) {
        render::PointList kept;
        for (const Eigen::Vector3f& point : strip) {
          if (kept.empty() || (point - kept.back()).norm() >= spacing) kept.push_back(point);
        }
        strip.swap(kept);
      }
    }
  }

  void addLines(render::PointList strip) {
    if (strip.size() >= 2) shapes_.strips.push_back(styledLine(std::move(strip), style_));
  }

  void addGlyphs() {
    std::vector<geometry_msgs::Pose> poses;
    for (const geometry_msgs::PoseStamped& pose : message_.poses) poses.push_back(pose.pose);
    render::Body solids = glyphsAt(poses, style_, remarks_).solids;
    if (solids.points.empty()) return;
    shapes_.glyphs = std::make_shared<const render::Body>(std::move(solids));
  }

  const nav_msgs::Path& message_;
  const PathStyle& style_;
  std::string frame_;
  std::vector<render::PointList> strips_;
  PathShapes shapes_;
  std::set<std::string> remarks_;
};

// ---------------------------------------------------------------------------------------- spreads
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

constexpr double kThin = 1e-3;                    // m; RViz's height of what is flat
constexpr double kWidestYaw = 89 * M_PI / 180.0;  // to either side

Rigid<World, World> placedAt(const Eigen::Vector3d& position, const Eigen::Matrix3d& R) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = position;
  T.linear() = R;
  return Rigid<World, World>(T);
}

/// The ellipsoid of one standard deviation times the scale. Absent: nothing or too much of it.
std::optional<render::Drawable> ellipsoid(const Matrix6& covariance,
                                          const Eigen::Vector3d& position,
                                          const CovarianceStyle& style,
                                          std::set<std::string>& remarks) {
  const bool is_flat = covariance.diagonal().segment<3>(2).maxCoeff() <= 0;
  Eigen::Matrix3d spread = covariance.topLeftCorner<3, 3>();
  if (is_flat) spread.row(2).setZero(), spread.col(2).setZero();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  Eigen::Vector3d size =
      2 * double{style.position_scale} * solver.eigenvalues().cwiseMax(0).cwiseSqrt();
  if (!(size.maxCoeff() <= kFarthest)) {
    remarks.insert("a covariance is absurdly large: its ellipse is left out");
    return std::nullopt;
  }
  if (!(size.maxCoeff() > 0)) return std::nullopt;
  Eigen::Matrix3d R = solver.eigenvectors();
  R.col(2) = R.col(0).cross(R.col(1));
  size = size.cwiseMax(kThin);
  return render::Drawable{placedAt(position, R), render::Sphere{size.cast<float>()},
                          style.position_color};
}

/// The triangle of the yaw's standard deviation, its tip at the pose.
std::optional<render::Drawable> yawTriangle(double variance, const Eigen::Isometry3d& pose,
                                            const CovarianceStyle& style) {
  if (!(variance > 0)) return std::nullopt;
  const double half = std::min(std::sqrt(variance) * double{style.orientation_scale}, kWidestYaw);
  const float length = style.orientation_offset;
  const auto y = static_cast<float>(std::tan(half)) * length;
  if (!(y > 0)) return std::nullopt;
  render::Triangles triangle{{{0, 0, 0}, {length, -y, 0}, {length, y, 0}}, {}};
  return render::Drawable{Rigid<World, World>(pose), std::move(triangle), style.orientation_color};
}

}  // namespace

Converted<PathShapes> toPathShapes(const nav_msgs::Path& message, const PathStyle& style) {
  if (message.poses.size() > kMostPoints) return refused<PathShapes>("too many points");
  return PathReader(message, style).read();
}

render::Lines styledLine(render::PointList points, const PathStyle& style) {
  render::Lines line;
  line.points = std::move(points);
  if (style.line == PathStyle::Line::Lines) line.width_px = style.width;
  if (style.line == PathStyle::Line::Billboards) line.width = style.width;
  return line;
}

Converted<Drawables> toPoseShapes(const std::vector<geometry_msgs::Pose>& poses,
                                  const PathStyle& style) {
  if (poses.size() > kMostPoints) return refused<Drawables>("too many points");
  std::set<std::string> remarks;
  Glyphs glyphs = glyphsAt(poses, style, remarks);
  Drawables drawables;
  const bool has_own_colors = style.poses == PathStyle::Poses::Axes;
  const render::Color color = has_own_colors ? render::Color{} : style.arrow_color;
  if (!glyphs.solids.points.empty()) {
    render::MeshInstance mesh;
    mesh.body = std::make_shared<const render::Body>(std::move(glyphs.solids));
    mesh.own_colors = has_own_colors;
    drawables.push_back({{}, std::move(mesh), color});
  }
  if (!glyphs.pairs.empty()) {
    render::Lines lines = styledLine(std::move(glyphs.pairs), style);
    lines.strip = false;
    drawables.push_back({{}, std::move(lines), color});
  }
  if (drawables.empty() && !poses.empty()) return refused<Drawables>(joined(remarks));
  return {std::move(drawables), joined(remarks)};
}

Converted<Drawables> toPoseShapes(const geometry_msgs::PoseWithCovariance& message,
                                  const PathStyle& style, const CovarianceStyle& spread) {
  const Matrix6 covariance = Eigen::Map<const Matrix6>(message.covariance.data());
  if (!covariance.allFinite()) return refused<Drawables>("a covariance is not finite");
  auto glyph = toPoseShapes(std::vector<geometry_msgs::Pose>{message.pose}, style);
  if (!glyph.value) return glyph;
  const Eigen::Isometry3d pose = *toPose(message.pose).value;
  std::set<std::string> remarks;
  if (!glyph.reason.empty()) remarks.insert(glyph.reason);
  if (spread.has_position) {
    if (auto drawn = ellipsoid(covariance, pose.translation(), spread, remarks)) {
      glyph.value->push_back(std::move(*drawn));
    }
  }
  if (spread.has_orientation) {
    if (auto drawn = yawTriangle(covariance(5, 5), pose, spread)) {
      glyph.value->push_back(std::move(*drawn));
    }
  }
  return {std::move(glyph.value), joined(remarks)};
}

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
