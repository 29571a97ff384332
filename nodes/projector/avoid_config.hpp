/// \file
/// The `avoid` block of a projector's configuration: what light keeps off, people and the robot's
/// own arm, and who sees them. assets/projector.yaml explains every key.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nodes/projector/layer_config.hpp"
#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {

/// A sensor that sees what stands in the light's way.
struct AvoidSource {
  LayerConfig layer;     ///< its topic; PointCloud2 or LaserScan
  double padding = 0.1;  ///< meters around each of its points
  double column = 0;  ///< meters up from the surface over which a point stands; 0: the point alone
};

/// The robot's description, whose links light keeps off.
struct AvoidedRobot {
  std::string description =
      "robot_description";  ///< parameter, in the node's namespace or above it
  double padding = 0.05;    ///< meters around its links
};

struct AvoidConfig {
  std::vector<AvoidSource> sources;
  std::optional<AvoidedRobot> robot;       ///< without it or sources: the other of the two is there
  double height = 0.1;                     ///< meters over a surface; what is lower may be lit
  double speed = 1.6;                      ///< m/s, of what sensors see
  std::int64_t patience_ns = 500'000'000;  ///< what is older than this tells nothing
};

/// The block's keys.
extern const std::vector<std::string> kAvoidKeys;

/// `has_surfaces`: the configuration has some. Throws std::runtime_error "FILE:LINE: what is
/// wrong".
AvoidConfig readAvoidConfig(const YamlMap& map, bool has_surfaces);

}  // namespace afterglow::nodes
