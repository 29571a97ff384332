#include "nodes/projector/avoid_config.hpp"

#include <algorithm>

namespace afterglow::nodes {
namespace {

constexpr double kMostPadding = 2, kMostHeight = 2, kMostColumn = 3;  // meters
constexpr double kMostSpeed = 10;                                     // m/s
constexpr double kLeastPatience = 0.05, kMostPatience = 5;            // s
/// Legs are seen, bodies are wider; and people are no taller.
constexpr double kScanPadding = 0.3, kScanColumn = 2;

AvoidSource readSource(const YamlMap& map) {
  AvoidSource source;
  source.layer.topic = map.text("topic");
  if (source.layer.topic.front() != '/') {
    map.fail(map.at("topic"), "topic '" + source.layer.topic + "' should begin with '/'");
  }
  const std::vector<std::string> names = {typeName(LayerType::PointCloud2),
                                          typeName(LayerType::LaserScan)};
  const bool is_scan = map.choice("type", names) == 1;
  source.layer.type = is_scan ? LayerType::LaserScan : LayerType::PointCloud2;
  if (!is_scan && map.has("column")) {
    map.fail(map.at("column"), "'column' in " + map.where() + " has no meaning without a scan");
  }
  source.padding = map.number("padding", 0, kMostPadding, is_scan ? kScanPadding : source.padding);
  source.column = map.number("column", 0, kMostColumn, is_scan ? kScanColumn : 0);
  return source;
}

void readSources(const YamlMap& map, AvoidConfig& config) {
  const YAML::Node from = map.at("from");
  if (!from.IsSequence() || from.size() == 0) {
    map.fail(from, "'from' of 'avoid' should be a list of at least one cloud or scan");
  }
  for (std::size_t i = 0; i < from.size(); ++i) {
    AvoidSource source =
        readSource(map.map(from[i], "source " + std::to_string(i + 1) + " of 'avoid'",
                           {"topic", "type", "padding", "column"}));
    const auto isSame = [&](const auto& other) { return other.layer.topic == source.layer.topic; };
    if (std::any_of(config.sources.begin(), config.sources.end(), isSame)) {
      map.fail(from[i], "topic '" + source.layer.topic + "' twice");
    }
    config.sources.push_back(std::move(source));
  }
}

AvoidedRobot readRobot(const YamlMap& map) {
  AvoidedRobot robot;
  if (map.has("description")) robot.description = map.text("description");
  if (robot.description.front() == '/') {
    map.fail(map.at("description"),
             "'description' of " + map.where() +
                 " is looked for in the node's namespace and above it: write it without '/'");
  }
  robot.padding = map.number("padding", 0, kMostPadding, robot.padding);
  return robot;
}

}  // namespace

const std::vector<std::string> kAvoidKeys = {"from", "robot", "height", "speed", "patience_s"};

AvoidConfig readAvoidConfig(const YamlMap& map, bool has_surfaces) {
  AvoidConfig config;
  if (!map.has("from") && !map.has("robot")) {
    map.fail(map.node(), "'avoid' needs 'from', clouds and scans that see people, or 'robot'");
  }
  if (map.has("from") && !has_surfaces) {
    map.fail(map.at("from"), "'from' of 'avoid' needs 'surfaces': what stands on them is avoided");
  }
  if (map.has("from")) readSources(map, config);
  if (map.has("robot")) {
    config.robot =
        readRobot(map.map(map.at("robot"), "'robot' of 'avoid'", {"description", "padding"}));
  }
  for (const char* key : {"height", "speed"}) {
    if (map.has(key) && !map.has("from")) {
      map.fail(map.at(key), "'" + std::string(key) + "' of 'avoid' has no meaning without 'from'");
    }
  }
  config.height = map.number("height", 0.01, kMostHeight, config.height);
  config.speed = map.number("speed", 0, kMostSpeed, config.speed);
  config.patience_ns =
      static_cast<std::int64_t>(1e9 * map.number("patience_s", kLeastPatience, kMostPatience,
                                                 1e-9 * static_cast<double>(config.patience_ns)));
  return config;
}

}  // namespace afterglow::nodes
