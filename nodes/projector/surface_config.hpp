/// \file
/// Where light may be laid: an entry of `surfaces` in a projector's configuration.
/// assets/projector.yaml explains every key.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "nodes/tools/yaml_map.hpp"
#include "render/scene/relief.hpp"

namespace afterglow::nodes {

/// A surface that is found in a point cloud instead of given.
struct SurfaceSearch {
  std::string topic;                     ///< sensor_msgs/PointCloud2
  double least_height, greatest_height;  ///< of the points that count, metres, z of the frame
  std::vector<Eigen::Vector2d> within;   ///< x and y of those; empty: anywhere
  double max_tilt;                       ///< radians between its normal and the frame's z
};

/// Heights over a surface that are measured from a point cloud.
struct ReliefConfig {
  std::string topic;  ///< sensor_msgs/PointCloud2
  render::ReliefOptions options;
};

struct SurfaceConfig {
  std::string name;
  std::string frame;                     ///< given: the surface is its z = 0 plane; found: in it
  std::vector<Eigen::Vector2d> polygon;  ///< given: metres; empty: unbounded
  std::optional<SurfaceSearch> search;   ///< found
  std::optional<ReliefConfig> relief;
  float gain = 1;  ///< of the light of what is laid on it

  /// Whether there is more to it than is configured.
  bool isMeasured() const { return search || relief; }
};

/// Throws std::runtime_error "FILE:LINE: what is wrong".
std::vector<SurfaceConfig> readSurfaceConfigs(const YamlMap& root);

}  // namespace afterglow::nodes
