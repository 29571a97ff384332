#include "nodes/projector/layer_config.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

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
  layer.reader = ReaderConfig{readFrame(reader, "frame"), {p[0], p[1], p[2]}, false};
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
    layer.viewer = ViewerConfig{readFrame(viewer, "frame"), {p[0], p[1], p[2]}};
  }
  if (map.has("reader")) readReader(map, surfaces, layer);
}

// In the order of the enums they name.
const std::vector<std::string> kPointStyles = {"points", "squares", "flat_squares", "spheres",
                                               "boxes"};
const std::vector<std::string> kLineStyles = {"lines", "billboards"};
const std::vector<std::string> kPoseStyles = {"none", "axes", "arrows"};

const std::vector<std::string> kLookKeys = {
    "style", "size", "color", "decay", "pose_style", "axes", "arrows", "buffer_length", "offset"};

// RViz's defaults.
constexpr float kPixels = 3, kPointSize = 0.01f;
constexpr double kLeastSize = 1e-4, kGreatestSize = 1e3;
const render::Color kWhite{1, 1, 1, 1};
const render::Color kPathGreen{25 / 255.0f, 1, 0, 1};

constexpr double kLongestDecay = 86'400;  // s
constexpr double kLongestBuffer = 1'000;  // paths
constexpr double kFarthestOffset = 1e4;   // m

bool hasPoints(LayerType type) {
  return type == LayerType::PointCloud2 || type == LayerType::LaserScan;
}

/// Keys without effect are mistakes.
void refuseMeaningless(const YamlMap& map, const LayerConfig& layer) {
  for (const std::string& key : kLookKeys) {
    const bool for_both = key == "style" || key == "size" || key == "color";
    const bool has_meaning =
        key == "decay" ? hasPoints(layer.type)
                       : layer.type == LayerType::Path || (for_both && hasPoints(layer.type));
    if (map.has(key) && !has_meaning) {
      map.fail(map.at(key),
               "'" + key + "' in " + map.where() + " has no meaning for " + typeName(layer.type));
    }
  }
}

float readSize(const YamlMap& map, const std::string& key, float otherwise) {
  return static_cast<float>(
      map.number(key, kLeastSize, kGreatestSize, static_cast<double>(otherwise)));
}

float readPixels(const YamlMap& map, float otherwise) {
  return static_cast<float>(
      map.number("size", 1, double{render::kLargestPoint}, static_cast<double>(otherwise)));
}

void readPoints(const YamlMap& map, LayerConfig& layer) {
  if (map.has("style")) {
    layer.cloud.style = static_cast<render::PointStyle>(map.choice("style", kPointStyles));
  }
  const bool in_pixels = layer.cloud.style == render::PointStyle::Points;
  layer.cloud.size = in_pixels ? readPixels(map, kPixels) : readSize(map, "size", kPointSize);
  layer.decay_ns = std::llround(map.number("decay", 0, kLongestDecay, 0) * 1e9);
}

void readAxes(const YamlMap& map, PathStyle& style) {
  style.axes_length = readSize(map, "length", style.axes_length);
  style.axes_diameter = readSize(map, "diameter", style.axes_diameter);
}

void readArrows(const YamlMap& map, PathStyle& style) {
  render::Arrow& arrow = style.arrow;
  const float shaft_length = readSize(map, "shaft_length", arrow.length - arrow.head_length);
  arrow.head_length = readSize(map, "head_length", arrow.head_length);
  arrow.length = shaft_length + arrow.head_length;
  arrow.shaft_diameter = readSize(map, "shaft_diameter", arrow.shaft_diameter);
  arrow.head_diameter = readSize(map, "head_diameter", arrow.head_diameter);
  if (map.has("color")) style.arrow_color = readPlainColor(map, "color");
}

void readPoses(const YamlMap& map, PathStyle& style) {
  if (map.has("pose_style")) {
    style.poses = static_cast<PathStyle::Poses>(map.choice("pose_style", kPoseStyles));
  }
  for (const std::string key : {"axes", "arrows"}) {
    if (!map.has(key)) continue;
    const bool is_axes = key == "axes";
    if (style.poses != (is_axes ? PathStyle::Poses::Axes : PathStyle::Poses::Arrows)) {
      map.fail(map.at(key),
               "'" + key + "' in " + map.where() + " has no meaning without pose_style " + key);
    }
    const std::string where = "the " + key + " of " + map.where();
    if (is_axes) {
      readAxes(map.map(map.at(key), where, {"length", "diameter"}), style);
    } else {
      readArrows(
          map.map(map.at(key), where,
                  {"color", "shaft_length", "shaft_diameter", "head_length", "head_diameter"}),
          style);
    }
  }
}

void readPath(const YamlMap& map, LayerConfig& layer) {
  PathStyle& style = layer.path;
  if (map.has("style")) {
    style.line = static_cast<PathStyle::Line>(map.choice("style", kLineStyles));
  }
  const bool in_pixels = style.line == PathStyle::Line::Lines;
  style.width = in_pixels ? readPixels(map, 1) : readSize(map, "size", style.width);
  readPoses(map, style);
  const double length = map.number("buffer_length", 1, kLongestBuffer, 1);
  if (length != std::floor(length)) {
    map.fail(map.at("buffer_length"), "'buffer_length' of " + map.where() + " counts paths");
  }
  layer.buffer_length = static_cast<int>(length);
  if (!map.has("offset")) return;
  const auto offset = map.numbers(map.at("offset"), "'offset' of " + map.where(), 3);
  layer.offset = Eigen::Vector3d(offset[0], offset[1], offset[2]);
  if (layer.offset.cwiseAbs().maxCoeff() > kFarthestOffset) {
    map.fail(map.at("offset"), "'offset' of " + map.where() + " is absurdly far");
  }
}

// In the order of ColorSource, without the flat color, which has no name.
const std::vector<std::string> kSources = {"rgb8",   "mono8",  "rgbf32", "intensity",
                                           "axis_x", "axis_y", "axis_z"};
constexpr double kGreatestValue = 1e12;

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

/// Empty if the value is no plain color.
std::optional<render::Color> plainColor(const YamlMap& map, const std::string& key) {
  const YAML::Node node = map.at(key);
  if (node.IsScalar()) return parseHexColor(node.Scalar());
  if (!node.IsSequence()) return std::nullopt;
  const auto rgb = map.numbers(node, "'" + key + "' of " + map.where(), 3);
  for (const double component : rgb) {
    if (component < 0 || component > 255) map.fail(node, "a color goes from 0 to 255");
  }
  return render::Color{static_cast<float>(rgb[0] / 255), static_cast<float>(rgb[1] / 255),
                       static_cast<float>(rgb[2] / 255), 1};
}

bool isOneOf(const std::string& name, std::initializer_list<const char*> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void setSource(const YamlMap& map, const std::string& name, LayerConfig& layer) {
  const auto source = std::find(kSources.begin(), kSources.end(), name);
  const bool has_packed_colors = isOneOf(name, {"rgb8", "mono8", "rgbf32"});
  const bool fits = layer.type == LayerType::PointCloud2 ||
                    (layer.type == LayerType::LaserScan && !has_packed_colors);
  if (!fits) map.fail(map.node(), typeName(layer.type) + " has no color '" + name + "'");
  layer.cloud.color = static_cast<ColorSource>(source - kSources.begin() + 1);
}

bool readFlag(const YamlMap& map, const std::string& key, bool otherwise) {
  return map.has(key) ? map.choice(key, {"false", "true"}) == 1 : otherwise;
}

void readBounds(const YamlMap& map, ColorScale& scale) {
  if (map.has("min") != map.has("max")) {
    map.fail(map.node(), "'min' and 'max' of " + map.where() + " go together");
  }
  if (!map.has("min")) return;
  const double least = map.number("min", -kGreatestValue, kGreatestValue);
  scale.bounds = {least, map.number("max", least, kGreatestValue)};
}

/// Keys without effect are mistakes.
void refuse(const YamlMap& map, std::initializer_list<const char*> keys, const std::string& why) {
  for (const char* key : keys) {
    if (!map.has(key)) continue;
    map.fail(map.at(key),
             "'" + std::string(key) + "' in " + map.where() + " has no meaning " + why);
  }
}

void readScale(const YamlMap& map, LayerConfig& layer) {
  const std::string by = kSources[map.choice("by", kSources)];
  setSource(map, by, layer);
  const bool by_intensity = by == "intensity", by_axis = isAxis(layer.cloud.color);
  if (!by_axis) refuse(map, {"fixed_frame"}, "without an axis");
  if (!by_intensity) {
    refuse(map, {"channel", "rainbow", "invert", "min_color", "max_color"}, "without intensity");
  }
  if (!by_intensity && !by_axis) refuse(map, {"min", "max"}, "for " + by);
  if (layer.type == LayerType::LaserScan) refuse(map, {"channel"}, "for " + typeName(layer.type));
  ColorScale& scale = layer.cloud.scale;
  scale.rainbow = readFlag(map, "rainbow", true);
  if (scale.rainbow) {
    refuse(map, {"min_color", "max_color"}, "with rainbow");
  } else {
    refuse(map, {"invert"}, "without rainbow");
  }
  scale.invert = readFlag(map, "invert", false);
  if (map.has("channel")) layer.cloud.channel = map.text("channel");
  if (map.has("min_color")) scale.least = readPlainColor(map, "min_color");
  if (map.has("max_color")) scale.greatest = readPlainColor(map, "max_color");
  layer.cloud.axis_of_fixed_frame = readFlag(map, "fixed_frame", true);
  readBounds(map, scale);
}

/// Reads a plain color; the name of a source of colors; or a map with `by`, that name, and how its
/// numbers become colors. Throws as readPlainColor.
void readColor(const YamlMap& map, LayerConfig& layer) {
  const YAML::Node node = map.at("color");
  if (node.IsMap()) {
    return readScale(map.map(node, "the color of " + map.where(),
                             {"by", "channel", "rainbow", "invert", "min_color", "max_color", "min",
                              "max", "fixed_frame"}),
                     layer);
  }
  if (const auto color = plainColor(map, "color")) {
    layer.flat_color = *color;
    return;
  }
  const std::string name = map.text("color");
  if (std::find(kSources.begin(), kSources.end(), name) == kSources.end()) {
    map.fail(node, "'color' of " + map.where() +
                       " should be \"#rrggbb\", [r, g, b], rgb8, mono8, " +
                       "rgbf32, intensity, axis_x, axis_y, axis_z or a map, not '" + name + "'");
  }
  setSource(map, name, layer);
}

/// The keys style, size, color and decay, and those of paths. Refuses keys without effect.
void readLook(const YamlMap& map, LayerConfig& layer) {
  refuseMeaningless(map, layer);
  layer.flat_color = layer.type == LayerType::Path ? kPathGreen : kWhite;
  if (map.has("color")) readColor(map, layer);
  if (hasPoints(layer.type)) readPoints(map, layer);
  if (layer.type == LayerType::Path) readPath(map, layer);
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

render::Color readPlainColor(const YamlMap& map, const std::string& key) {
  if (const auto color = plainColor(map, key)) return *color;
  map.fail(map.at(key), "'" + key + "' of " + map.where() + " should be \"#rrggbb\" or [r, g, b]");
}

}  // namespace afterglow::nodes
