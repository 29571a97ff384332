#include "nodes/projector/watch_config.hpp"

#include <ros/names.h>

#include <filesystem>
#include <system_error>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/tag_layout_file.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kDefaultLimit_mm = 10;

/// Decided by what is written: a path that was made absolute looks like a topic.
CameraSource readCameraSource(const std::string& written, const std::string& folder) {
  std::string error;
  std::error_code none;
  const bool is_topic = written.front() == '/' && ros::names::validate(written, error) &&
                        !std::filesystem::is_regular_file(written, none);
  if (is_topic) return CameraTopic{written};
  return CameraFile{(std::filesystem::path(folder) / written).string()};
}

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
  config.camera_info = readCameraSource(map.text("camera_info"), folder);
  const std::string tags = (std::filesystem::path(folder) / map.text("tags")).string();
  config.layout = loadTagLayout(tags);
  config.layout.frame = frameName(config.layout.frame);
  if (!isFrameName(config.layout.frame)) {
    map.fail(map.at("tags"), tags + " names no 'frame': the tf frame whose plane the tags lie on");
  }
  config.period_s = map.number("period_s", 0.1, 3600, config.period_s);
  config.limit_px = readLimit(map, "limit_px");
  config.limit_mm = readLimit(map, "limit_mm");
  if (!config.limit_px && !config.limit_mm) config.limit_mm = kDefaultLimit_mm;
  return config;
}

}  // namespace afterglow::nodes
