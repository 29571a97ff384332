#include "nodes/projector/layer_config.hpp"

#include <algorithm>
#include <cctype>

#include "nodes/projector/projector_config.hpp"

namespace afterglow::nodes {
namespace {

// In the order of the enums they name.
const std::vector<std::string> kTypes = {"sensor_msgs/PointCloud2", "sensor_msgs/LaserScan",
                                         "nav_msgs/Path", "visualization_msgs/Marker",
                                         "visualization_msgs/MarkerArray"};
const std::vector<std::string> kStyles = {"points", "squares", "flat_squares", "spheres", "boxes"};
const std::vector<std::string> kPlacements = {"direct", "drape", "viewer"};
const std::vector<std::string> kColorSources = {"flat",   "rgb8",   "intensity",
                                                "axis_x", "axis_y", "axis_z"};

// RViz's defaults for what is not configured.
constexpr float kPixels = 3, kPointSize = 0.01f, kLineWidth = 0.03f;
constexpr double kLeastSize = 1e-4, kGreatestSize = 1e3;
const render::Color kWhite{1, 1, 1, 1};
const render::Color kPathGreen{25 / 255.0f, 1, 0, 1};

bool hasPoints(LayerType type) {
  return type == LayerType::PointCloud2 || type == LayerType::LaserScan;
}
bool hasMarkers(LayerType type) {
  return type == LayerType::Marker || type == LayerType::MarkerArray;
}

std::optional<render::Color> parseHexColor(const std::string& text) {
  if (text.size() != 7 || text[0] != '#') return std::nullopt;
  const bool digits = std::all_of(text.begin() + 1, text.end(),
                                  [](unsigned char c) { return std::isxdigit(c) != 0; });
  if (!digits) return std::nullopt;
  const unsigned long bits = std::stoul(text.substr(1), nullptr, 16);
  const auto channel = [bits](int shift) {
    return static_cast<float>((bits >> shift) & 0xffu) / 255.0f;
  };
  return render::Color{channel(16), channel(8), channel(0), 1};
}

/// A key that would do nothing is a mistake to be told about.
void refuseMeaningless(const YamlMap& map, LayerType type) {
  for (const char* key : {"style", "size", "color"}) {
    const bool meaningless =
        hasMarkers(type) || (type == LayerType::Path && std::string(key) == "style");
    if (meaningless && map.has(key)) {
      map.fail(map.at(key), "'" + std::string(key) + "' in " + map.where() +
                                " has no meaning for " + typeName(type));
    }
  }
}

void readColor(const YamlMap& map, LayerConfig& layer) {
  const YAML::Node node = map.at("color");
  if (node.IsSequence()) {
    const auto rgb = map.numbers(node, "'color' of " + map.where(), 3);
    for (const double component : rgb) {
      if (component < 0 || component > 255) map.fail(node, "a color goes from 0 to 255");
    }
    layer.flat_color = {static_cast<float>(rgb[0] / 255), static_cast<float>(rgb[1] / 255),
                        static_cast<float>(rgb[2] / 255), 1};
    return;
  }
  if (const auto color = parseHexColor(map.text("color"))) {
    layer.flat_color = *color;
    return;
  }
  const auto source = std::find(kColorSources.begin() + 1, kColorSources.end(), node.Scalar());
  if (source == kColorSources.end()) {
    map.fail(node, "'color' of " + map.where() + " should be \"#rrggbb\", [r, g, b], rgb8, " +
                       "intensity, axis_x, axis_y or axis_z, not '" + node.Scalar() + "'");
  }
  layer.cloud.color = static_cast<ColorSource>(source - kColorSources.begin());
  const bool fits = layer.type == LayerType::PointCloud2 ||
                    (layer.type == LayerType::LaserScan && *source != "rgb8");
  if (!fits) map.fail(node, typeName(layer.type) + " has no color '" + *source + "'");
}

void readLook(const YamlMap& map, LayerConfig& layer) {
  layer.flat_color = layer.type == LayerType::Path ? kPathGreen : kWhite;
  if (map.has("color")) readColor(map, layer);
  if (map.has("style")) {
    layer.cloud.style = static_cast<render::PointStyle>(map.choice("style", kStyles));
  }
  const bool in_pixels = hasPoints(layer.type) && layer.cloud.style == render::PointStyle::Points;
  layer.cloud.size = static_cast<float>(map.number(
      "size", in_pixels ? 1 : kLeastSize, kGreatestSize, in_pixels ? kPixels : kPointSize));
  layer.line_width = static_cast<float>(map.number("size", kLeastSize, kGreatestSize, kLineWidth));
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

const std::vector<std::string> kLayerKeys = {"topic", "type",      "style",   "size",   "color",
                                             "alpha", "placement", "surface", "viewer", "reader"};

LayerConfig readLayerConfig(const YamlMap& map, const std::vector<SurfaceConfig>& surfaces) {
  LayerConfig layer;
  layer.topic = map.text("topic");
  if (layer.topic.front() != '/') {
    map.fail(map.at("topic"), "topic '" + layer.topic + "' should begin with '/'");
  }
  layer.type = static_cast<LayerType>(map.choice("type", kTypes));
  layer.alpha = static_cast<float>(map.number("alpha", 0, 1, 1));
  refuseMeaningless(map, layer.type);
  readLook(map, layer);
  readPlacement(map, surfaces, layer);
  return layer;
}

}  // namespace afterglow::nodes
