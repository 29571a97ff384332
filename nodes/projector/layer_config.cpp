#include "nodes/projector/layer_config.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include "nodes/projector/projector_config.hpp"

namespace afterglow::nodes {
namespace {

/// In the order of LayerType.
std::vector<std::string> typeNames() {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::tuple_size_v<LayerMessages>; ++i) {
    names.push_back(typeName(static_cast<LayerType>(i)));
  }
  return names;
}

// In the order of the enums they name.
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
const std::vector<std::string> kShapes = {"axes", "arrow", "flat_arrow"};
const std::vector<std::string> kColorSchemes = {"map", "costmap", "raw"};

// RViz's defaults.
constexpr float kPixels = 3, kPointSize = 0.01f;
constexpr double kLeastSize = 1e-4, kGreatestSize = 1e3;
const render::Color kWhite{1, 1, 1, 1};
const render::Color kPathGreen{25 / 255.0f, 1, 0, 1}, kPoseRed{1, 25 / 255.0f, 0, 1};
constexpr double kMapAlpha = 0.7, kRangeAlpha = 0.5;

constexpr double kLongestDecay = 86'400;  // s
constexpr double kLongestBuffer = 1'000;  // messages
constexpr double kFarthestOffset = 1e4;   // m

bool hasPoints(LayerType type) {
  return type == LayerType::PointCloud2 || type == LayerType::LaserScan;
}
bool isPolygon(LayerType type) {
  return type == LayerType::Polygon || type == LayerType::PolygonArray;
}
bool hasCovariance(LayerType type) {
  return type == LayerType::PoseWithCovariance || type == LayerType::Odometry;
}
bool isPose(LayerType type) {
  return type == LayerType::Pose || type == LayerType::PoseArray || hasCovariance(type);
}

/// Returns whether a key of the look means something for a type.
bool hasMeaning(const std::string& key, LayerType type) {
  const bool is_path = type == LayerType::Path, is_image = type == LayerType::Image;
  const bool has_line = is_path || isPolygon(type) || type == LayerType::PoseArray;
  const std::map<std::string, bool> meanings = {
      {"style", hasPoints(type) || has_line},
      {"size", hasPoints(type) || has_line || is_image},
      {"color", hasPoints(type) || is_path || isPolygon(type) || isPose(type) ||
                    type == LayerType::GridCells || type == LayerType::Range},
      {"decay", hasPoints(type)},
      {"pose_style", is_path},
      {"axes", is_path || isPose(type)},
      {"arrows", is_path || isPose(type)},
      {"buffer_length", is_path || type == LayerType::Range},
      {"offset", is_path || is_image},
      {"shape", isPose(type)},
      {"covariance", hasCovariance(type)},
      {"keep", type == LayerType::Odometry},
      {"position_tolerance", type == LayerType::Odometry},
      {"angle_tolerance", type == LayerType::Odometry},
      {"color_scheme", type == LayerType::OccupancyGrid},
      {"camera_info", is_image},
      {"distance", is_image},
  };
  const auto found = meanings.find(key);
  return found == meanings.end() || found->second;
}

/// Keys without effect are mistakes.
void refuseMeaningless(const YamlMap& map, const LayerConfig& layer) {
  for (const std::string& key : kLayerKeys) {
    if (map.has(key) && !hasMeaning(key, layer.type)) {
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

/// Reads the sizes of the glyphs that `by` has chosen.
void readGlyphs(const YamlMap& map, const std::string& by, PathStyle& style) {
  for (const std::string key : {"axes", "arrows"}) {
    if (!map.has(key)) continue;
    const bool is_axes = key == "axes";
    const bool is_flat = style.poses == PathStyle::Poses::FlatArrows;
    const PathStyle::Poses wanted = is_axes   ? PathStyle::Poses::Axes
                                    : is_flat ? PathStyle::Poses::FlatArrows
                                              : PathStyle::Poses::Arrows;
    if (style.poses != wanted) {
      const std::string chosen = by == "shape" && !is_axes ? "arrow" : key;
      map.fail(map.at(key),
               "'" + key + "' in " + map.where() + " has no meaning without " + by + " " + chosen);
    }
    const std::string where = "the " + key + " of " + map.where();
    if (is_axes) {
      readAxes(map.map(map.at(key), where, {"length", "diameter"}), style);
    } else if (is_flat) {
      style.flat_arrow_length =
          readSize(map.map(map.at(key), where, {"length"}), "length", style.flat_arrow_length);
    } else {
      readArrows(
          map.map(map.at(key), where,
                  {"color", "shaft_length", "shaft_diameter", "head_length", "head_diameter"}),
          style);
    }
  }
}

void readLine(const YamlMap& map, PathStyle& style) {
  if (map.has("style")) {
    style.line = static_cast<PathStyle::Line>(map.choice("style", kLineStyles));
  }
  const bool in_pixels = style.line == PathStyle::Line::Lines;
  style.width = in_pixels ? readPixels(map, 1) : readSize(map, "size", style.width);
}

int readCount(const YamlMap& map, const std::string& key, int otherwise, const std::string& what) {
  const double count = map.number(key, 1, kLongestBuffer, otherwise);
  if (count != std::floor(count)) {
    map.fail(map.at(key), "'" + key + "' of " + map.where() + " counts " + what);
  }
  return static_cast<int>(count);
}

Eigen::Vector3d readOffset(const YamlMap& map) {
  if (!map.has("offset")) return Eigen::Vector3d::Zero();
  const auto offset = map.numbers(map.at("offset"), "'offset' of " + map.where(), 3);
  const Eigen::Vector3d p(offset[0], offset[1], offset[2]);
  if (p.cwiseAbs().maxCoeff() > kFarthestOffset) {
    map.fail(map.at("offset"), "'offset' of " + map.where() + " is absurdly far");
  }
  return p;
}

void readPath(const YamlMap& map, LayerConfig& layer) {
  readLine(map, layer.path);
  if (map.has("pose_style")) {
    layer.path.poses = static_cast<PathStyle::Poses>(map.choice("pose_style", kPoseStyles));
  }
  readGlyphs(map, "pose_style", layer.path);
  layer.buffer_length = readCount(map, "buffer_length", 1, "paths");
  layer.offset = readOffset(map);
}

void readPolygon(const YamlMap& map, LayerConfig& layer) {
  layer.filled = map.has("style") && map.choice("style", {"lines", "billboards", "filled"}) == 2;
  if (!layer.filled) return readLine(map, layer.path);
  if (map.has("size")) {
    map.fail(map.at("size"), "'size' in " + map.where() + " has no meaning with style filled");
  }
}

/// A part of the covariance: false, or a map of its looks. Returns whether it is shown.
bool readSpread(const YamlMap& map, const std::string& key, render::Color& color, float& scale,
                float* offset) {
  if (!map.has(key)) return true;
  if (!map.at(key).IsMap()) return readFlag(map, key, true);
  std::vector<std::string> keys = {"color", "alpha", "scale"};
  if (offset != nullptr) keys.emplace_back("offset");
  const YamlMap part = map.map(map.at(key), "the " + key + " of " + map.where(), keys);
  const double alpha = part.number("alpha", 0, 1, double{color.a});
  if (part.has("color")) color = readPlainColor(part, "color");
  color.a = static_cast<float>(alpha);
  scale = readSize(part, "scale", scale);
  if (offset != nullptr) *offset = readSize(part, "offset", *offset);
  return true;
}

void readCovariance(const YamlMap& map, CovarianceStyle& style) {
  if (!map.has("covariance")) return;
  if (!map.at("covariance").IsMap()) {
    style.has_position = style.has_orientation = readFlag(map, "covariance", true);
    return;
  }
  const YamlMap parts = map.map(map.at("covariance"), "the covariance of " + map.where(),
                                {"position", "orientation"});
  style.has_position =
      readSpread(parts, "position", style.position_color, style.position_scale, nullptr);
  style.has_orientation = readSpread(parts, "orientation", style.orientation_color,
                                     style.orientation_scale, &style.orientation_offset);
}

/// Sizes are RViz's, which calls the diameters radii.
void readPose(const YamlMap& map, LayerConfig& layer) {
  PathStyle& style = layer.path;
  const bool is_array = layer.type == LayerType::PoseArray;
  style.poses = is_array ? PathStyle::Poses::FlatArrows : PathStyle::Poses::Arrows;
  style.arrow =
      is_array ? render::Arrow{0.3f, 0.01f, 0.03f, 0.07f} : render::Arrow{1.3f, 0.05f, 0.1f, 0.3f};
  style.axes_length = is_array ? 0.3f : 1;
  style.axes_diameter = is_array ? 0.01f : 0.1f;
  style.width = 0.01f;
  style.arrow_color = layer.flat_color;
  if (map.has("shape")) {
    const std::size_t shapes = is_array ? 3 : 2;
    const std::size_t shape = map.choice(
        "shape", {kShapes.begin(), kShapes.begin() + static_cast<std::ptrdiff_t>(shapes)});
    style.poses = static_cast<PathStyle::Poses>(shape + 1);
  }
  readGlyphs(map, "shape", style);
  if (style.poses == PathStyle::Poses::FlatArrows) {
    readLine(map, style);
  } else {
    for (const std::string key : {"style", "size"}) {
      if (!map.has(key)) continue;
      map.fail(map.at(key),
               "'" + key + "' in " + map.where() + " has no meaning without shape flat_arrow");
    }
  }
  readCovariance(map, layer.covariance);
  if (layer.type != LayerType::Odometry) return;
  layer.buffer_length = readCount(map, "keep", 100, "arrows");
  layer.position_tolerance = map.number("position_tolerance", 0, kGreatestSize, 0.1);
  layer.angle_tolerance = map.number("angle_tolerance", 0, M_PI, 0.1);
}

void readImage(const YamlMap& map, LayerConfig& layer) {
  if (map.has("camera_info")) layer.camera_info = map.text("camera_info");
  const bool is_seen = !layer.camera_info.empty();
  if (is_seen && layer.camera_info.front() != '/') {
    map.fail(map.at("camera_info"),
             "'camera_info' of " + map.where() + " is a topic: it should begin with '/'");
  }
  for (const std::string key : {"size", "offset", "distance"}) {
    if (!map.has(key) || (key == "distance") == is_seen) continue;
    map.fail(map.at(key), "'" + key + "' in " + map.where() + " has no meaning with" +
                              (is_seen ? "" : "out") + " camera_info");
  }
  layer.image.width = double{readSize(map, "size", 1)};
  layer.image.distance = map.number("distance", kLeastSize, kGreatestSize, 1);
  layer.image.center = readOffset(map);
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

render::Color usualColor(LayerType type) {
  if (isPose(type)) return kPoseRed;
  const bool is_white = hasPoints(type) || type == LayerType::Range;
  return is_white || hasMarkers(type) ? kWhite : kPathGreen;
}

/// The keys of the look. Refuses keys without effect.
void readLook(const YamlMap& map, LayerConfig& layer) {
  refuseMeaningless(map, layer);
  layer.flat_color = usualColor(layer.type);
  if (map.has("color")) readColor(map, layer);
  if (hasPoints(layer.type)) readPoints(map, layer);
  if (layer.type == LayerType::Path) readPath(map, layer);
  if (isPolygon(layer.type)) readPolygon(map, layer);
  if (isPose(layer.type)) readPose(map, layer);
  if (layer.type == LayerType::Range)
    layer.buffer_length = readCount(map, "buffer_length", 1, "ranges");
  if (map.has("color_scheme")) {
    layer.color_scheme = static_cast<ColorScheme>(map.choice("color_scheme", kColorSchemes));
  }
  if (layer.type == LayerType::Image) readImage(map, layer);
}

}  // namespace

std::string typeName(LayerType type) {
  std::string name;
  withMessageType(type, [&name](auto tag) {
    name = ros::message_traits::DataType<typename decltype(tag)::Type>::value();
  });
  return name;
}

const std::vector<std::string> kLayerKeys = {
    "topic",           "type",         "style",       "size",    "color",
    "alpha",           "decay",        "placement",   "surface", "viewer",
    "reader",          "pose_style",   "axes",        "arrows",  "buffer_length",
    "offset",          "shape",        "covariance",  "keep",    "position_tolerance",
    "angle_tolerance", "color_scheme", "camera_info", "distance"};

LayerConfig readLayerConfig(const YamlMap& map, const std::vector<SurfaceConfig>& surfaces) {
  LayerConfig layer;
  layer.topic = map.text("topic");
  if (layer.topic.front() != '/') {
    map.fail(map.at("topic"), "topic '" + layer.topic + "' should begin with '/'");
  }
  layer.type = static_cast<LayerType>(map.choice("type", typeNames()));
  const double alpha = layer.type == LayerType::OccupancyGrid ? kMapAlpha
                       : layer.type == LayerType::Range       ? kRangeAlpha
                                                              : 1;
  layer.alpha = static_cast<float>(map.number("alpha", 0, 1, alpha));
  readLook(map, layer);
  readPlacement(map, surfaces, layer);
  return layer;
}

render::Color readPlainColor(const YamlMap& map, const std::string& key) {
  if (const auto color = plainColor(map, key)) return *color;
  map.fail(map.at(key), "'" + key + "' of " + map.where() + " should be \"#rrggbb\" or [r, g, b]");
}

}  // namespace afterglow::nodes
