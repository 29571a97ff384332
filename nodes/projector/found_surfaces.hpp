/// \file
/// Surfaces and reliefs as point clouds show them. No ROS master is involved.
#pragma once

#include <sensor_msgs/PointCloud2.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "nodes/projector/surface_config.hpp"
#include "render/scene/relief.hpp"

namespace afterglow::nodes {

/// What there is to a surface beyond its configuration. Stays where it is in the surface's frame.
struct FoundSurface {
  Eigen::Isometry3d T_frame_surface = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Vector2d> polygon;
  std::shared_ptr<const render::Relief> relief;  ///< where one is configured
};

/// One surface's outcome.
struct Finding {
  std::shared_ptr<const FoundSurface> surface;  ///< none: not found
  std::string text;  ///< "surface 'table': 1.20 x 0.70 m at height 0.72 m, ...", or why not
};

/// Points in the surface's frame: those of its search and those of its relief; an empty list where
/// it has none. Never throws.
Finding findSurface(const SurfaceConfig& config, const std::vector<Eigen::Vector3d>& search_points,
                    const std::vector<Eigen::Vector3d>& relief_points);

/// Collects one cloud for every topic that surfaces are found or measured in; then finds them. The
/// buffer and the configuration must outlive this; one thread at a time.
class SurfaceFinder {
 public:
  SurfaceFinder(const std::vector<SurfaceConfig>& surfaces, const tf2::BufferCore& buffer);

  /// Topics whose cloud is still missing.
  const std::vector<std::string>& topics() const { return topics_; }
  /// Takes a cloud if there is a transform to every frame it is wanted in. A cloud that cannot be
  /// read counts as one without points.
  bool take(const std::string& topic, const sensor_msgs::PointCloud2& cloud);
  /// By index of the configuration; for those that are given the surface is none and the text
  /// empty.
  std::vector<Finding> find() const;

 private:
  using Points = std::vector<Eigen::Vector3d>;

  const Points& points(const std::string& topic, const std::string& frame) const;

  const std::vector<SurfaceConfig>& surfaces_;
  const tf2::BufferCore& buffer_;
  std::vector<std::string> topics_;
  std::map<std::pair<std::string, std::string>, Points> points_;  ///< by topic and frame
  std::map<std::string, std::string> faults_;                     ///< by topic
};

}  // namespace afterglow::nodes
