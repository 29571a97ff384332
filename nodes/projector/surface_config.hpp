/// \file
/// A surface that light falls on: an entry of `surfaces` in a projector's configuration.
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
  double least_height, greatest_height;  ///< z in the frame of the points that count, meters
  std::vector<Eigen::Vector2d> within;   ///< outline around their x and y; empty: anywhere
  double max_tilt;                       ///< radians between its normal and the frame's z
};

/// Heights over a surface that are measured from a point cloud.
struct ReliefConfig {
  std::string topic;  ///< sensor_msgs/PointCloud2
  render::ReliefOptions options;
};

struct SurfaceConfig {
  std::string name;
  std::string frame;                     ///< if given, the surface is the z = 0 plane of the frame
  std::vector<Eigen::Vector2d> polygon;  ///< if given: meters; empty: unbounded
  std::optional<SurfaceSearch> search;   ///< search for a surface found in `frame`
  std::optional<ReliefConfig> relief;
  float gain = 1;  ///< factor of the light of its layers

  /// Returns true if point clouds have to tell something about it.
  bool isMeasured() const { return search || relief; }
};

/// Throws std::runtime_error "FILE:LINE: what is wrong".
std::vector<SurfaceConfig> readSurfaceConfigs(const YamlMap& root);

}  // namespace afterglow::nodes
