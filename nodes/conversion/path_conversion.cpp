#include "nodes/conversion/path_conversion.hpp"

#include <fmt/format.h>

#include <memory>
#include <set>
#include <string>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/path_glyphs.hpp"

namespace afterglow::nodes {
namespace {

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
    body->is_closed = true;  // each of its solids is
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
