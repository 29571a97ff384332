// What a publisher on the network sends to be drawn: bytes that are a message of the right type, and
// whatever numbers are in them. An input is a letter, which says of what type, and the bytes.
#include <geometry_msgs/PolygonStamped.h>
#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include "nodes/conversion/cloud_conversion.hpp"
#include "nodes/conversion/grid_conversion.hpp"
#include "nodes/conversion/marker_conversion.hpp"
#include "nodes/conversion/path_conversion.hpp"
#include "nodes/conversion/typed_message.hpp"
#include "tests/fuzz/target.hpp"

namespace afterglow::fuzz::conversion_fuzz {
namespace {

using namespace nodes;
using replay::Bytes;

void drawCloud(const Bytes& bytes) {
  const auto cloud = toMessage<sensor_msgs::PointCloud2>(bytes);
  if (!cloud) return;
  for (const ColorSource source : {ColorSource::Flat, ColorSource::Rgb8, ColorSource::Intensity}) {
    CloudStyle style;
    style.color = source;
    toPointCloud(*cloud, style);
  }
}

void drawMarkers(const Bytes& bytes) {
  static MarkerAssets assets;
  const auto markers = toMessage<visualization_msgs::MarkerArray>(bytes);
  if (!markers) return;
  for (const visualization_msgs::Marker& marker : markers->markers) toDrawable(marker, assets);
}

void drawPath(const Bytes& bytes) {
  const auto path = toMessage<nav_msgs::Path>(bytes);
  if (!path) return;
  PathStyle style;
  style.poses = PathStyle::Poses::Arrows;
  toPathShapes(*path, style);
}

void drawScan(const Bytes& bytes) {
  const auto scan = toMessage<sensor_msgs::LaserScan>(bytes);
  if (!scan) return;
  CloudStyle style;
  style.color = ColorSource::Intensity;
  toScanPoints(*scan, style);
}

template <typename Message, typename Draw>
void drawAs(const Bytes& bytes, const Draw& draw) {
  if (const auto message = toMessage<Message>(bytes)) draw(*message);
}

void drawPoses(const Bytes& bytes) {
  PathStyle style;
  style.poses = PathStyle::Poses::Axes;
  drawAs<geometry_msgs::PoseArray>(bytes, [&](const auto& m) { toPoseShapes(m.poses, style); });
  drawAs<geometry_msgs::PoseWithCovarianceStamped>(
      bytes, [&](const auto& m) { toPoseShapes(m.pose, style, {}); });
}

}  // namespace

AFTERGLOW_FUZZ_TARGET(conversion) {
  if (size == 0) return;
  const Bytes bytes(data + 1, data + size);
  switch (data[0]) {
    case 'c': return drawCloud(bytes);
    case 'm': return drawMarkers(bytes);
    case 'p': return drawPath(bytes);
    case 's': return drawScan(bytes);
    case 'o':
      return drawPoses(bytes);
    case 'y':
      return drawAs<geometry_msgs::PolygonStamped>(
          bytes, [](const auto& m) { toPolygonShapes(m.polygon, {}, true, {}); });
    case 'e':
      return drawAs<nav_msgs::GridCells>(bytes, [](const auto& m) { toCellShapes(m, {}); });
    case 'r':
      return drawAs<sensor_msgs::Range>(bytes, [](const auto& m) { toConeShapes(m, {}); });
    case 'g':
      return drawAs<nav_msgs::OccupancyGrid>(
          bytes, [](const auto& m) { toMapShapes(m, ColorScheme::Costmap); });
    case 'i':
      return drawAs<sensor_msgs::Image>(bytes, [](const auto& m) { toImageShapes(m, {}); });
    default: return;
  }
}

}  // namespace afterglow::fuzz::conversion_fuzz
