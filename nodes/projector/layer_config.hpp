/// \file
/// The content and look of a topic: an entry of `layers` in a projector's configuration.
/// assets/projector.yaml explains every key.
#pragma once

#include <geometry_msgs/PolygonStamped.h>
#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <jsk_recognition_msgs/PolygonArray.h>
#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/GridCells.h>
#include <nav_msgs/OccupancyGrid.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/Range.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "nodes/conversion/cloud_conversion.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/grid_conversion.hpp"
#include "nodes/conversion/path_conversion.hpp"
#include "nodes/tools/yaml_map.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// The frame's name without the leading slash of old. Throws std::runtime_error "FILE:LINE: what is
/// wrong" for a name that tf2 does not know.
inline std::string readFrame(const YamlMap& map, const std::string& key) {
  const std::string name = frameName(map.text(key));
  if (!isFrameName(name)) {
    map.fail(map.at(key),
             "'" + key + "' of " + map.where() + " is no frame's name: '" + map.text(key) + "'");
  }
  return name;
}

/// Reads true or false, or takes `otherwise` without the key. Throws as readFrame does.
inline bool readFlag(const YamlMap& map, const std::string& key, bool otherwise) {
  return map.has(key) ? map.choice(key, {"false", "true"}) == 1 : otherwise;
}

struct SurfaceConfig;

enum class LayerType {
  PointCloud2,
  LaserScan,
  Path,
  Marker,
  MarkerArray,
  Polygon,
  PolygonArray,
  Pose,
  PoseArray,
  PoseWithCovariance,
  Odometry,
  GridCells,
  Range,
  OccupancyGrid,
  Image,
};
/// Their messages, in the order of LayerType.
using LayerMessages =
    std::tuple<sensor_msgs::PointCloud2, sensor_msgs::LaserScan, nav_msgs::Path,
               visualization_msgs::Marker, visualization_msgs::MarkerArray,
               geometry_msgs::PolygonStamped, jsk_recognition_msgs::PolygonArray,
               geometry_msgs::PoseStamped, geometry_msgs::PoseArray,
               geometry_msgs::PoseWithCovarianceStamped, nav_msgs::Odometry, nav_msgs::GridCells,
               sensor_msgs::Range, nav_msgs::OccupancyGrid, sensor_msgs::Image>;

template <typename MessageType>
struct MessageTag {
  using Type = MessageType;
};

/// Calls `f` with the MessageTag of a layer's type.
template <typename Function, std::size_t at = 0>
void withMessageType(LayerType type, Function&& f) {
  if (static_cast<std::size_t>(type) == at)
    return f(MessageTag<std::tuple_element_t<at, LayerMessages>>());
  if constexpr (at + 1 < std::tuple_size_v<LayerMessages>)
    withMessageType<Function, at + 1>(type, std::forward<Function>(f));
}

/// The same of the layer's second topic, if it has one.
template <typename Function>
void withSecondType(LayerType type, Function&& f) {
  if (type == LayerType::OccupancyGrid) return f(MessageTag<map_msgs::OccupancyGridUpdate>());
  if (type == LayerType::Image) return f(MessageTag<sensor_msgs::CameraInfo>());
}

/// "sensor_msgs/PointCloud2" and so on.
std::string typeName(LayerType type);

/// The eye that Placement::Viewer draws for.
struct ViewerConfig {
  std::string frame;
  Eigen::Vector3d p_frame;  ///< meters
};

/// The reader that Placement::Drape turns text to.
struct ReaderConfig {
  std::string frame;
  Eigen::Vector3d p_frame;    ///< meters
  bool is_direction = false;  ///< p_frame is a direction
};

struct LayerConfig {
  std::string topic;  ///< absolute
  LayerType type = LayerType::Marker;
  CloudStyle cloud;           ///< PointCloud2 and LaserScan
  std::int64_t decay_ns = 0;  ///< decay of their points; 0: until the next message
  PathStyle path;             ///< Path, polygons and poses
  bool filled = false;        ///< polygons
  CovarianceStyle covariance;
  int buffer_length = 1;  ///< number of the last messages that are shown
  /// Odometry; nearer to the pose shown last than both: not shown. Meters, radians.
  double position_tolerance = 0.1, angle_tolerance = 0.1;
  ColorScheme color_scheme = ColorScheme::Map;
  std::string camera_info;  ///< topic that places an image; empty: it lies flat
  ImagePlane image;         ///< without its lens
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< of paths; meters, in the fixed frame
  render::Color flat_color;                          ///< color of what has none of its own
  float alpha = 1;
  render::Placement placement = render::Placement::Direct;
  std::optional<std::size_t> surface;  ///< index of the surface; set for Drape and Viewer
  std::optional<ViewerConfig> viewer;  ///< set for Viewer
  std::optional<ReaderConfig> reader;  ///< markers' reader, Drape; empty: at the surface's -y

  /// Returns the topic beside its own that its content needs, of a grid's updates or an image's
  /// CameraInfo; else empty.
  std::string secondTopic() const {
    return type == LayerType::OccupancyGrid ? topic + "_updates" : camera_info;
  }
};

/// The keys of a layer.
extern const std::vector<std::string> kLayerKeys;

/// `surfaces` are those a layer may lie on. Throws std::runtime_error "FILE:LINE: what is wrong".
LayerConfig readLayerConfig(const YamlMap& map, const std::vector<SurfaceConfig>& surfaces);

/// "#rrggbb" or [r, g, b] up to 255. Throws std::runtime_error "FILE:LINE: what is wrong".
render::Color readPlainColor(const YamlMap& map, const std::string& key);

}  // namespace afterglow::nodes
