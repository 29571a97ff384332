#include "nodes/projector/layer_content.hpp"

#include <utility>

#include "nodes/conversion/path_conversion.hpp"
#include "nodes/conversion/scan_conversion.hpp"

namespace afterglow::nodes {
namespace {

Content cloudContent(render::PointCloud cloud, const LayerConfig& config) {
  Content content;
  content.decay_ns = config.decay_ns;
  if (cloud.points.empty()) return content;
  const CloudStyle& style = config.cloud;
  if (isAxis(style.color)) {
    const AxisColor color{axisOf(style.color), style.scale};
    if (style.axis_of_fixed_frame) {
      content.axis_color = color;
    } else {
      colorByAxis(cloud, color, Eigen::Isometry3d::Identity());
    }
  }
  // Colors of its own stand for themselves; the flat color is not to tint them.
  const bool is_flat = style.color == ColorSource::Flat;
  content.drawables.push_back(
      {{}, std::move(cloud), is_flat ? config.flat_color : render::Color{}});
  return content;
}

}  // namespace

Converted<Content> toContent(const sensor_msgs::PointCloud2& message, const LayerConfig& config) {
  auto cloud = toPointCloud(message, config.cloud);
  if (!cloud.value) return refused<Content>(cloud.reason);
  return {cloudContent(std::move(*cloud.value), config), cloud.reason};
}

Converted<Content> toContent(const sensor_msgs::LaserScan& message, const LayerConfig& config) {
  auto scan = toScanPoints(message, config.cloud);
  if (!scan.value) return refused<Content>(scan.reason);
  Content content = cloudContent(std::move(scan.value->cloud), config);
  content.sweep = std::move(scan.value->sweep);
  return {std::move(content), scan.reason};
}

Converted<Content> toContent(const nav_msgs::Path& message, const LayerConfig& config) {
  auto shapes = toPathShapes(message, config.path);
  if (!shapes.value) return refused<Content>(shapes.reason);
  Content content;
  content.offset = config.offset;
  for (render::Lines& strip : shapes.value->strips) {
    content.drawables.push_back({{}, std::move(strip), config.flat_color});
  }
  if (shapes.value->glyphs) {
    const bool own_colors = config.path.poses == PathStyle::Poses::Axes;
    render::MeshInstance glyphs;
    glyphs.body = std::move(shapes.value->glyphs);
    glyphs.own_colors = own_colors;
    content.drawables.push_back(
        {{}, std::move(glyphs), own_colors ? render::Color{} : config.path.arrow_color});
  }
  return {std::move(content), shapes.reason};
}

}  // namespace afterglow::nodes
