#include "nodes/projector/watch_config.hpp"

#include <filesystem>

#include "nodes/tools/tag_layout_file.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kDefaultLimit_mm = 10;

std::optional<double> readLimit(const YamlMap& map, const std::string& key) {
  if (!map.has(key)) return std::nullopt;
  return map.number(key, 0.01, 1e4);
}

}  // namespace

const std::vector<std::string> kWatchKeys = {"image",    "camera_info", "tags",
                                             "period_s", "limit_px",    "limit_mm"};

WatchConfig readWatchConfig(const YamlMap& map, const std::string& folder) {
  WatchConfig config;
  config.image_topic = map.text("image");
  if (config.image_topic.front() != '/') {
    map.fail(map.at("image"), "'image' of 'watch' is a topic: it should begin with '/'");
  }
  config.camera_info = map.text("camera_info");
  if (config.camera_info.front() != '/') {
    config.camera_info = (std::filesystem::path(folder) / config.camera_info).string();
  }
  const std::string tags = (std::filesystem::path(folder) / map.text("tags")).string();
  config.layout = loadTagLayout(tags);
  if (config.layout.frame.empty()) {
    map.fail(map.at("tags"), tags + " names no 'frame': the tf frame whose plane the tags lie on");
  }
  config.period_s = map.number("period_s", 0.1, 3600, config.period_s);
  config.limit_px = readLimit(map, "limit_px");
  config.limit_mm = readLimit(map, "limit_mm");
  if (!config.limit_px && !config.limit_mm) config.limit_mm = kDefaultLimit_mm;
  return config;
}

}  // namespace afterglow::nodes
