#include "nodes/projector/color_config.hpp"

#include <algorithm>
#include <cctype>

namespace afterglow::nodes {
namespace {

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

}  // namespace

render::Color readPlainColor(const YamlMap& map, const std::string& key) {
  if (const auto color = plainColor(map, key)) return *color;
  map.fail(map.at(key), "'" + key + "' of " + map.where() + " should be \"#rrggbb\" or [r, g, b]");
}

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

}  // namespace afterglow::nodes
