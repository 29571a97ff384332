/// \file
/// Everything a projector has to show, from messages and transforms to a scene in world
/// coordinates: what projector_node and `afterglow render` have in common. No ROS master is
/// involved.
#pragma once

#include <nav_msgs/Path.h>
#include <ros/time.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2/buffer_core.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "nodes/conversion/marker_assets.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "nodes/projector/layer_state.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/projector/scene_surfaces.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// One moment's worth. World is the configuration's fixed frame.
struct SceneFrame {
  render::Scene scene;
  /// Of the first projector. Absent while its pose is unknown or stale: then nothing may be lit.
  std::optional<Rigid<Projector, World>> T_projector_world;
  std::vector<std::string> problems;  ///< one line each, for people; empty: all is well
};

/// Feeds on messages (a layer is named by its index in the configuration), in the order of their
/// arrival; `now` is ROS time of arrival or drawing and must not run backwards: clear() when it
/// does. Bad messages are counted, never thrown. The buffer must outlive this; one thread at a
/// time.
class ProjectorScene {
 public:
  ProjectorScene(ProjectorConfig config, const tf2::BufferCore& buffer);

  void add(std::size_t layer, const sensor_msgs::PointCloud2& message, ros::Time now);
  void add(std::size_t layer, const sensor_msgs::LaserScan& message, ros::Time now);
  void add(std::size_t layer, const nav_msgs::Path& message, ros::Time now);
  void add(std::size_t layer, const visualization_msgs::Marker& message, ros::Time now);
  void add(std::size_t layer, const visualization_msgs::MarkerArray& message, ros::Time now);
  /// Reads the meshes that a message names, so that add() finds them read. The one thing that may
  /// run beside everything else, in any thread; a file can take seconds.
  void prepare(const visualization_msgs::Marker& message);
  void prepare(const visualization_msgs::MarkerArray& message);
  /// A message whose bytes are no message.
  void drop(std::size_t layer, const std::string& reason);

  /// What was found of one of the configuration's surfaces, or why not (SceneSurfaces).
  void takeSurface(std::size_t surface, const Finding& finding);

  /// Lets waiting content in and expired content out.
  void update(ros::Time now);
  /// update(), and what is there to be seen from any projector. Adds to `problems`.
  render::Scene scene(ros::Time now, std::vector<std::string>& problems);
  /// Where one of the configuration's projectors is by the time its light leaves, as of the last
  /// update(). Absent, with a problem, while that is unknown.
  std::optional<Rigid<Projector, World>> projectorPose(std::size_t projector, ros::Time now,
                                                       std::vector<std::string>& problems);
  /// Both, for the first projector.
  SceneFrame frame(ros::Time now);
  /// Whether content waits for its transform: it may appear with the next.
  bool isWaiting() const;
  /// Forgets all content (not the counts): time has jumped.
  void clear();

  std::vector<LayerStatus> status() const;
  const ProjectorConfig& config() const { return config_; }

 private:
  void addContent(std::size_t layer, const std_msgs::Header& header, Converted<Content> content,
                  ros::Time now);
  /// One of its own for what decays; else the places of the buffer in turn.
  ContentKey nextKey(std::size_t layer);
  void addMarker(LayerState& layer, const visualization_msgs::Marker& marker, ros::Time now);
  void show(LayerState& layer, const ContentKey& key, const std_msgs::Header& header,
            Content content, ros::Time now);
  std::optional<render::Layer> layer(std::size_t index, std::vector<std::string>& problems);

  ProjectorConfig config_;
  FrameLookup frames_;
  SceneSurfaces surfaces_;
  std::vector<LayerState> layers_;
  std::vector<int> next_;  ///< by layer, for nextKey()
  MarkerAssets assets_;
};

}  // namespace afterglow::nodes
