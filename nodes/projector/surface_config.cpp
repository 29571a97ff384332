#include "nodes/projector/surface_config.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nodes/projector/layer_config.hpp"
#include "render/scene/triangulate.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kFarthest = 100;                 // meters
constexpr double kTilt = 10, kGreatestTilt = 60;  // degrees
constexpr double kGreatestGain = 10;
constexpr double kLeastCell = 0.001, kGreatestCell = 1;

std::vector<Eigen::Vector2d> readPolygon(const YamlMap& map, const std::string& key) {
  const YAML::Node node = map.at(key);
  std::vector<Eigen::Vector2d> polygon;
  for (std::size_t i = 0; node.IsSequence() && i < node.size(); ++i) {
    const auto corner = map.numbers(node[i], "a corner of " + map.where(), 2);
    polygon.emplace_back(corner[0], corner[1]);
  }
  if (!(std::abs(render::signedArea(polygon)) > 0)) {
    map.fail(node, "the polygon of " + map.where() + " has no area");
  }
  return polygon;
}

/// Two numbers, the first one less than the second.
void readSpan(const YamlMap& map, const std::string& key, double& least, double& greatest) {
  const YAML::Node node = map.at(key);
  const auto span = map.numbers(node, "'" + key + "' of " + map.where(), 2);
  if (!(span[0] < span[1] && span[0] >= -kFarthest && span[1] <= kFarthest)) {
    map.fail(node, "'" + key + "' of " + map.where() +
                       " should be [least, greatest] in meters, the first one less");
  }
  least = span[0];
  greatest = span[1];
}

std::string readTopic(const YamlMap& map, const std::string& key) {
  std::string topic = map.text(key);
  if (topic.front() != '/') {
    map.fail(map.at(key), "topic '" + topic + "' should begin with '/'");
  }
  return topic;
}

SurfaceSearch readSearch(const YamlMap& map) {
  SurfaceSearch search{};
  search.topic = readTopic(map, "find_in");
  readSpan(map, "height", search.least_height, search.greatest_height);
  if (map.has("within")) search.within = readPolygon(map, "within");
  search.max_tilt = map.number("tilt_deg", 0.1, kGreatestTilt, kTilt) * M_PI / 180;
  return search;
}

ReliefConfig readRelief(const YamlMap& map) {
  ReliefConfig relief;
  relief.topic = readTopic(map, "from");
  relief.options.cell = map.number("cell", kLeastCell, kGreatestCell, relief.options.cell);
  if (map.has("height")) {
    readSpan(map, "height", relief.options.least, relief.options.greatest);
  }
  return relief;
}

void refuseMixture(const YamlMap& map, bool is_found) {
  if (is_found && map.has("polygon")) {
    map.fail(map.at("polygon"), map.where() + " is either given ('polygon') or found ('find_in')");
  }
  for (const char* key : {"height", "within", "tilt_deg"}) {
    if (!is_found && map.has(key)) {
      map.fail(map.at(key), "'" + std::string(key) + "' in " + map.where() +
                                " has no meaning without 'find_in'");
    }
  }
}

SurfaceConfig readSurface(const YamlMap& map, const YamlMap& root, const std::string& name) {
  SurfaceConfig surface;
  surface.name = name;
  surface.frame = readFrame(map, "frame");
  surface.gain = static_cast<float>(map.number("gain", 0, kGreatestGain, 1));
  refuseMixture(map, map.has("find_in"));
  if (map.has("polygon")) surface.polygon = readPolygon(map, "polygon");
  if (map.has("find_in")) surface.search = readSearch(map);
  if (map.has("relief")) {
    surface.relief = readRelief(
        root.map(map.at("relief"), "the relief of " + map.where(), {"from", "cell", "height"}));
  }
  return surface;
}

}  // namespace

std::vector<SurfaceConfig> readSurfaceConfigs(const YamlMap& root) {
  const YAML::Node node = root.at("surfaces");
  if (!node.IsMap()) root.fail(node, "'surfaces' should map names to surfaces");
  std::vector<SurfaceConfig> surfaces;
  for (const auto& entry : node) {
    const std::string name = entry.first.Scalar();
    const auto same = [&name](const auto& other) { return other.name == name; };
    if (std::any_of(surfaces.begin(), surfaces.end(), same)) {
      root.fail(entry.first, "surface '" + name + "' twice");
    }
    const YamlMap map =
        root.map(entry.second, "surface '" + name + "'",
                 {"frame", "polygon", "find_in", "height", "within", "tilt_deg", "relief", "gain"});
    surfaces.push_back(readSurface(map, root, name));
  }
  return surfaces;
}

}  // namespace afterglow::nodes
