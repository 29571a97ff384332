/// \file
/// The way from messages and transforms to the scene that projectors show, in world coordinates.
/// Shared by projector_node and `afterglow render`. Needs no ROS master.
#pragma once

#include <ros/time.h>
#include <tf2/buffer_core.h>

#include <cstddef>
#include <future>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "nodes/conversion/marker_conversion.hpp"
#include "nodes/conversion/mesh_library.hpp"
#include "nodes/projector/found_surfaces.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "nodes/projector/layer_state.hpp"
#include "nodes/projector/light_offset.hpp"
#include "nodes/projector/projector_config.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

using FutureMesh = std::shared_future<MeshLibrary::Mesh>;
/// Or refused.
bool isRead(const FutureMesh& mesh);

/// A marker of a layer, as it arrived.
struct UnreadMesh {
  std::size_t layer = 0;
  visualization_msgs::Marker marker;
  ros::Time arrived;
  FutureMesh mesh;

  ContentKey key() const { return {marker.ns, marker.id}; }
};

/// Meshes in the order of their arrival, one for each layer and key. One thread at a time.
class UnreadMeshes {
 public:
  static constexpr std::size_t kMost = 1000;

  /// False: too many wait; this one is not kept.
  bool add(UnreadMesh unread);
  void remove(std::size_t layer, const ContentKey& key);
  void removeAll(std::size_t layer);
  void clear() { waiting_.clear(); }
  /// Returns those whose meshes have been read or refused by now; they do not wait any more.
  std::vector<UnreadMesh> takeRead();
  const std::list<UnreadMesh>& waiting() const { return waiting_; }

 private:
  std::list<UnreadMesh> waiting_;
};

/// The scene of one moment. World is the configuration's fixed frame.
struct SceneSnapshot {
  render::Scene scene;
  /// Pose of the first projector. Empty while its pose is unknown or stale: it must then show
  /// nothing.
  std::optional<Rigid<Projector, World>> T_projector_world;
  /// The same of the other projectors, in their order.
  std::vector<std::optional<Rigid<Projector, World>>> T_others_world;
  std::vector<std::string> problems;  ///< problems, a line each, for people
};

/// Takes messages in the order of their arrival; `layer` is the index in the configuration, `now`
/// the ROS time of arrival or drawing. When that time runs backwards, call clear() first. Bad
/// messages are counted and never throw. The buffer must outlive this; one thread at a time.
class ProjectorScene {
 public:
  /// The moment at which the meshes are read that markers name. Beside the drawing: the marker is
  /// shown once its mesh has been read; what it replaces is gone at once.
  enum class MeshReading { WithMessages, BesideDrawing };

  ProjectorScene(ProjectorConfig config, const tf2::BufferCore& buffer,
                 MeshReading reading = MeshReading::WithMessages);

  template <typename MessageType>
  void add(std::size_t layer, const MessageType& message, ros::Time now) {
    addContent(layer, message.header, toContent(message, config_.layers[layer]), now);
  }
  void add(std::size_t layer, const sensor_msgs::PointCloud2& message, ros::Time now) {
    addContent(layer, message.header, toContent(message, config_.layers[layer], &workers_), now);
  }
  void add(std::size_t layer, const visualization_msgs::Marker& message, ros::Time now);
  void add(std::size_t layer, const visualization_msgs::MarkerArray& message, ros::Time now);
  /// Each polygon by its own header.
  void add(std::size_t layer, const jsk_recognition_msgs::PolygonArray& message, ros::Time now);
  /// A pose near the one before is passed over, as in RViz.
  void add(std::size_t layer, const nav_msgs::Odometry& message, ros::Time now);
  void add(std::size_t layer, const nav_msgs::OccupancyGrid& message, ros::Time now);
  void add(std::size_t layer, const map_msgs::OccupancyGridUpdate& message, ros::Time now);
  void add(std::size_t layer, const sensor_msgs::Image& message, ros::Time now);
  void add(std::size_t layer, const sensor_msgs::CameraInfo& message, ros::Time now);
  /// A command to the base that carries projectors, where one is configured.
  void addCommand(const geometry_msgs::Twist& command, ros::Time now);
  /// Counts a message that cannot be deserialized.
  void drop(std::size_t layer, const std::string& reason);

  /// The result of the search for one of the configuration's surfaces (SceneSurfaces).
  void takeSurface(std::size_t surface, const Finding& finding);

  /// Shows waiting content whose transform has come, and removes expired content.
  void update(ros::Time now);
  /// update(), then the scene, which is the same for all projectors. Adds to `problems`.
  render::Scene scene(ros::Time now, std::vector<std::string>& problems);
  /// The pose of one of the configuration's projectors at the time its light leaves, if drawing
  /// takes so long, as of the last update(). Empty, with a problem, while that is unknown.
  std::optional<Rigid<Projector, World>> projectorPose(std::size_t projector, ros::Time now,
                                                       std::int64_t drawing_ns,
                                                       std::vector<std::string>& problems);
  /// Takes the pose of a projector's picture that was handed over at `shown`.
  void noteLight(std::size_t projector, ros::Time shown,
                 const Rigid<Projector, World>& T_projector_world);
  /// How far the light of noteLight()'s pictures turned out to lie from its place.
  const LightOffset& lightOffset(std::size_t projector) const { return offsets_[projector]; }
  /// scene() and projectorPose() of the first projector.
  SceneSnapshot snapshot(ros::Time now);
  /// Returns the surfaces whose place is known, as of the last scene().
  std::vector<render::SurfacePatch> surfaces() const { return surfaces_.known(); }
  /// Returns true while content waits for a transform or a mesh, which may come at any time.
  bool isWaiting() const;
  /// Forgets all content but maps, which are sent once, and not the counts, because time has
  /// jumped.
  void clear();

  std::vector<LayerStatus> status() const;
  const ProjectorConfig& config() const { return config_; }

 private:
  void addContent(std::size_t layer, const std_msgs::Header& header, Converted<Content> content,
                  ros::Time now);
  /// A new key for content that decays; else the keys of the layer's buffer, in turn.
  ContentKey nextKey(std::size_t layer);
  void addMarker(std::size_t layer, const visualization_msgs::Marker& marker, ros::Time now);
  /// Returns the mesh that is to be waited for; not valid: there is none.
  FutureMesh meshOf(const visualization_msgs::Marker& marker);
  void showMarker(LayerState& layer, const visualization_msgs::Marker& marker, ros::Time arrived,
                  const MeshLibrary::Mesh* mesh = nullptr);
  void show(LayerState& layer, const ContentKey& key, const std_msgs::Header& header,
            Content content, ros::Time now);
  std::optional<render::Layer> layer(std::size_t index, std::vector<std::string>& problems);
  /// Returns where a frame will be by what its base is told, as seen from where it would be if it
  /// went on as it moved. The identity: nothing is told.
  Eigen::Isometry3d commandedDeparture(const std::string& frame, const StampedPose& newest,
                                       std::int64_t when_ns);

  /// A layer's earlier messages, which later ones need.
  struct Memory {
    nav_msgs::OccupancyGrid map;  ///< without cells: none has come
    std::optional<geometry_msgs::Pose> odometry;
    std::optional<calib::Lens> lens;
    std::optional<sensor_msgs::Image> image;  ///< waits for the lens
    int polygons = 0;                         ///< of the last array
  };

  ProjectorConfig config_;
  FrameLookup frames_;
  SceneSurfaces surfaces_;
  std::vector<LayerState> layers_;
  std::vector<int> next_;       ///< next keys by layer
  std::vector<Memory> memory_;  ///< by layer
  MarkerAssets assets_;
  MeshReading reading_;
  UnreadMeshes unread_;
  std::vector<LightOffset> offsets_;  ///< by projector
  std::optional<CommandedMotion> commanded_;
  render::Workers workers_;
};

}  // namespace afterglow::nodes
