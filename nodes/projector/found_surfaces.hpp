/// \file
/// Surfaces and reliefs as point clouds show them, and where they are now. Needs no ROS master.
#pragma once

#include <sensor_msgs/PointCloud2.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/projector/frame_lookup.hpp"
#include "nodes/projector/surface_config.hpp"
#include "render/scene/relief.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// The findings about a surface. It does not move in the surface's frame.
struct FoundSurface {
  Eigen::Isometry3d T_frame_surface = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Vector2d> polygon;
  std::shared_ptr<const render::Relief> relief;  ///< relief, where one is configured
};

/// The result of the search for one surface.
struct Finding {
  std::shared_ptr<const FoundSurface> surface;  ///< null: not found
  std::string text;  ///< "surface 'table': 1.20 x 0.70 m at height 0.72 m, ...", or why not
};

/// Collects one cloud of every topic that a surface is searched or measured in, then finds the
/// surfaces. The buffer and the configuration must outlive this; one thread at a time.
class SurfaceFinder {
 public:
  SurfaceFinder(const std::vector<SurfaceConfig>& surfaces, const tf2::BufferCore& buffer);

  /// Topics whose cloud is still missing.
  const std::vector<std::string>& topics() const { return topics_; }
  /// Takes the cloud and returns true if tf knows every frame that it is needed in. A cloud that
  /// cannot be read is taken, as one without points.
  bool take(const std::string& topic, const sensor_msgs::PointCloud2& cloud);
  /// Returns the findings by index of the configuration. Surfaces that are given, not found, have
  /// empty findings.
  std::vector<Finding> find() const;

 private:
  using Points = std::vector<Eigen::Vector3d>;

  const Points& points(const std::string& topic, const std::string& frame) const;

  const std::vector<SurfaceConfig>& surfaces_;
  const tf2::BufferCore& buffer_;
  std::vector<std::string> topics_;
  std::map<std::pair<std::string, std::string>, Points> points_;  ///< points by topic and frame
  std::map<std::string, std::string> faults_;                     ///< faults by topic
};

/// The configured surfaces of a scene, given or found. One thread at a time.
class SceneSurfaces {
 public:
  explicit SceneSurfaces(const std::vector<SurfaceConfig>& configs);

  /// Uses this finding from now on. A failed search only replaces another failed search.
  void take(std::size_t surface, const Finding& finding);
  /// Looks up where all surfaces are; `problems` gets a line for each whose place is unknown.
  void update(FrameLookup& frames, std::vector<std::string>& problems);

  /// Returns a surface as of the last update(); empty while unknown.
  const std::optional<render::SurfacePatch>& operator[](std::size_t surface) const {
    return patches_[surface];
  }
  std::vector<render::SurfacePatch> known() const;

 private:
  std::vector<SurfaceConfig> configs_;
  std::vector<Finding> findings_;
  std::vector<std::optional<render::SurfacePatch>> patches_;
};

}  // namespace afterglow::nodes
