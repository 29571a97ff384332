#include "nodes/projector/layer_config.hpp"

#include "nodes/projector/look_config.hpp"
#include "nodes/projector/projector_config.hpp"

namespace afterglow::nodes {
namespace {

// In the order of the enums they name.
const std::vector<std::string> kTypes = {"sensor_msgs/PointCloud2", "sensor_msgs/LaserScan",
                                         "nav_msgs/Path", "visualization_msgs/Marker",
                                         "visualization_msgs/MarkerArray"};
const std::vector<std::string> kPlacements = {"direct", "drape", "viewer"};

bool hasMarkers(LayerType type) {
  return type == LayerType::Marker || type == LayerType::MarkerArray;
}

void readReader(const YamlMap& map, const std::vector<SurfaceConfig>& surfaces,
                LayerConfig& layer) {
  const YAML::Node node = map.at("reader");
  if (!hasMarkers(layer.type) || layer.placement != render::Placement::Drape) {
    map.fail(node,
             "'reader' in " + map.where() + " has no meaning without markers and placement drape");
  }
  if (node.IsSequence()) {
    const auto p = map.numbers(node, "'reader' of " + map.where(), 2);
    const bool has_direction = p[0] != 0 || p[1] != 0;
    if (!has_direction) map.fail(node, "'reader' of " + map.where() + " has no direction");
    layer.reader = ReaderConfig{surfaces[*layer.surface].frame, {p[0], p[1], 0}, true};
    return;
  }
  const YamlMap reader = map.map(node, "the reader of " + map.where(), {"frame", "position"});
  const auto p = reader.numbers(reader.at("position"), "'position' of " + reader.where(), 3);
  layer.reader = ReaderConfig{reader.text("frame"), {p[0], p[1], p[2]}, false};
}

void readPlacement(const YamlMap& map, const std::vector<SurfaceConfig>& surfaces,
                   LayerConfig& layer) {
  if (map.has("placement")) {
    layer.placement = static_cast<render::Placement>(map.choice("placement", kPlacements));
  }
  const bool on_surface = layer.placement != render::Placement::Direct;
  if (on_surface != map.has("surface")) {
    map.fail(map.node(), on_surface ? "'placement' of " + map.where() + " needs a 'surface'"
                                    : "'surface' in " + map.where() +
                                          " has no meaning without placement drape or viewer");
  }
  if (on_surface) {
    std::vector<std::string> names;
    for (const SurfaceConfig& surface : surfaces) names.push_back(surface.name);
    layer.surface = map.choice("surface", names);
  }
  const bool has_viewer = layer.placement == render::Placement::Viewer;
  if (has_viewer != map.has("viewer")) {
    map.fail(map.node(), has_viewer ? "placement viewer of " + map.where() + " needs a 'viewer'"
                                    : "'viewer' in " + map.where() +
                                          " has no meaning without placement viewer");
  }
  if (has_viewer) {
    const YamlMap viewer =
        map.map(map.at("viewer"), "the viewer of " + map.where(), {"frame", "position"});
    const auto p = viewer.numbers(viewer.at("position"), "'position' of " + viewer.where(), 3);
    layer.viewer = ViewerConfig{viewer.text("frame"), {p[0], p[1], p[2]}};
  }
  if (map.has("reader")) readReader(map, surfaces, layer);
}

}  // namespace

std::string typeName(LayerType type) { return kTypes[static_cast<std::size_t>(type)]; }

const std::vector<std::string> kLayerKeys = {
    "topic",   "type",   "style",  "size",       "color", "alpha",  "decay",         "placement",
    "surface", "viewer", "reader", "pose_style", "axes",  "arrows", "buffer_length", "offset"};

LayerConfig readLayerConfig(const YamlMap& map, const std::vector<SurfaceConfig>& surfaces) {
  LayerConfig layer;
  layer.topic = map.text("topic");
  if (layer.topic.front() != '/') {
    map.fail(map.at("topic"), "topic '" + layer.topic + "' should begin with '/'");
  }
  layer.type = static_cast<LayerType>(map.choice("type", kTypes));
  layer.alpha = static_cast<float>(map.number("alpha", 0, 1, 1));
  readLook(map, layer);
  readPlacement(map, surfaces, layer);
  return layer;
}

}  // namespace afterglow::nodes
