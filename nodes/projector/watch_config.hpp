/// \file
/// The `watch` block of a projector's configuration: tags, camera and limits of the drift watch.
#pragma once

#include <optional>
#include <string>
#include <variant>

#include "calib/verify/tag_layout.hpp"
#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {

struct CameraTopic {
  std::string name;
};
struct CameraFile {
  std::string path;
};
/// The source of the camera's lens.
using CameraSource = std::variant<CameraTopic, CameraFile>;

struct WatchConfig {
  std::string image_topic;
  CameraSource camera_info;
  calib::TagLayout layout;  ///< known tags on the z = 0 plane of layout.frame, which tf knows
  double period_s = 10;
  std::optional<double> limit_px, limit_mm;  ///< limits of the median offset; at least one is set
};

/// Keys: image, camera_info (a topic, if it is written as one and no file is called so, else a
/// file), tags (paths are relative to `folder`), period_s, limit_px, limit_mm.
/// Throws std::runtime_error "FILE:LINE: what is wrong", also for what is wrong in the tags' file.
WatchConfig readWatchConfig(const YamlMap& map, const std::string& folder);

/// The block's keys.
extern const std::vector<std::string> kWatchKeys;

}  // namespace afterglow::nodes
