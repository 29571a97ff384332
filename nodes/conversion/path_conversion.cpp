#include "nodes/conversion/path_conversion.hpp"

#include <fmt/format.h>

#include <memory>
#include <set>
#include <string>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "render/scene/solids.hpp"

namespace afterglow::nodes {
namespace {

void addSolid(const render::Solid& solid, const Eigen::Affine3d& placed, render::Body& body) {
  const auto first = static_cast<std::uint32_t>(body.points.size());
  for (const Eigen::Vector3d& p : solid.points) body.points.push_back((placed * p).cast<float>());
  for (const auto& t : solid.triangles) {
    body.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
}

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
    return {std::move(shapes_), fmt::format("{}", fmt::join(remarks_, "; "))};
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
    if (strip.size() < 2) return;
    render::Lines line;
    line.points = std::move(strip);
    if (style_.line == PathStyle::Line::Lines) line.width_px = style_.width;
    if (style_.line == PathStyle::Line::Billboards) line.width = style_.width;
    shapes_.strips.push_back(std::move(line));
  }

  void addGlyphs() {
    const std::size_t stride = (message_.poses.size() + kMostGlyphs - 1) / kMostGlyphs;
    if (stride > 1) remarks_.insert("too many poses: some have no axes or arrow");
    auto body = std::make_shared<render::Body>();
    for (std::size_t i = 0; i < message_.poses.size(); i += stride) {
      const auto pose = toPose(message_.poses[i].pose);
      if (!pose.reason.empty()) remarks_.insert("a pose's " + pose.reason);
      if (!pose.value) continue;
      if (style_.poses == PathStyle::Poses::Axes) {
        addAxes(*pose.value, style_.axes_length, style_.axes_diameter, *body);
      } else {
        addArrow(*pose.value, style_.arrow, *body);
      }
    }
    body->is_closed = true;  // all of its solids are
    if (!body->points.empty()) shapes_.glyphs = std::move(body);
  }

  const nav_msgs::Path& message_;
  const PathStyle& style_;
  std::string frame_;
  std::vector<render::PointList> strips_;
  PathShapes shapes_;
  std::set<std::string> remarks_;
};

}  // namespace

Converted<PathShapes> toPathShapes(const nav_msgs::Path& message, const PathStyle& style) {
  if (message.poses.size() > kMostPoints) return refused<PathShapes>("too many points");
  return PathReader(message, style).read();
}

}  // namespace afterglow::nodes
