/// \file
/// The content and look of a topic: an entry of `layers` in a projector's configuration.
/// assets/projector.yaml explains every key.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nodes/conversion/cloud_conversion.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
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

struct SurfaceConfig;

enum class LayerType { PointCloud2, LaserScan, Path, Marker, MarkerArray };

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
  PathStyle path;             ///< Path; the next two as well
  int buffer_length = 1;      ///< number of the last paths that are shown
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< meters, in the fixed frame
  render::Color flat_color;  ///< color of all types but markers, which have their own colors
  float alpha = 1;
  render::Placement placement = render::Placement::Direct;
  std::optional<std::size_t> surface;  ///< index of the surface; set for Drape and Viewer
  std::optional<ViewerConfig> viewer;  ///< set for Viewer
  std::optional<ReaderConfig> reader;  ///< markers' reader, Drape; empty: at the surface's -y
};

/// The keys of a layer.
extern const std::vector<std::string> kLayerKeys;

/// `surfaces` are those a layer may lie on. Throws std::runtime_error "FILE:LINE: what is wrong".
LayerConfig readLayerConfig(const YamlMap& map, const std::vector<SurfaceConfig>& surfaces);

/// "#rrggbb" or [r, g, b] up to 255. Throws std::runtime_error "FILE:LINE: what is wrong".
render::Color readPlainColor(const YamlMap& map, const std::string& key);

}  // namespace afterglow::nodes
