/// \file
/// The world around a behavior, as its snapshot keeps it: poses between the anchors, the robot's
/// description, its map, the projector's calibration, the nodes around its topics.
///
/// Keeps the sounds and meshes that recorded messages refer to, as they are now.
#pragma once

#include <nav_msgs/OccupancyGrid.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <tf2/buffer_core.h>

#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/projector/transform_listener.hpp"
#include "nodes/recorder/recorder_options.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Any thread.
class WorldSnapshot {
 public:
  /// The store must outlive this.
  WorldSnapshot(const RecorderNodeOptions& options, replay::Store& store);

  /// Returns the robot's names: its namespace is this node's, its frames' prefix as tf has it.
  replay::RobotNames robot() const;
  /// The newest poses between anchors that are neighbors in the list and connected.
  replay::Snapshot::Frames frames() const;
  /// SHA-256 of robot_description, which the store keeps; empty if there is none.
  std::string urdf();
  /// Returns the map that the robot is localized on: mapIdentity(); empty if there is none.
  std::string map() const;
  /// A JSON object: the texts of the calibration folder's projector.yaml and
  /// T_camera_projector.yaml by their names, and "camera_info" as it is published; what there is.
  std::string calibration() const;

 private:
  const RecorderNodeOptions& options_;
  replay::Store& store_;
  tf2::BufferCore buffer_;
  TransformListener transforms_{buffer_};
  mutable std::mutex mutex_;  ///< the rest
  std::string urdf_text_, urdf_sha256_;
  std::string map_;
  std::optional<sensor_msgs::CameraInfo> camera_info_;
  ros::NodeHandle node_;
  ros::Subscriber camera_info_subscriber_, map_subscriber_;
};

/// Asks the master who publishes and who hears these topics, the answers of those that are goals,
/// and all velocities and joysticks, without this node. Empty if it does not answer.
replay::RecordedNodes nodesNow(const std::vector<std::string>& topics);

/// SHA-256 over size, resolution, origin and cells: the same for the same map, whenever it was
/// loaded.
std::string mapIdentity(const nav_msgs::OccupancyGrid& map);

/// SHA-256 by URI of those that the store now has. Others are remarked upon: missing,
/// over 20 MiB, neither package:// nor file://, by its name no sound and no mesh, or elsewhere: a
/// message may name any file of this machine, and a link may lead to any other. A file's real path
/// must lie in its package, for file:// in one of `roots`, a ROS package or /usr/share/sounds.
/// Throws StoreError.
std::map<std::string, std::string> keepFiles(replay::Store& store,
                                             const std::set<std::string>& uris,
                                             const std::vector<std::string>& roots,
                                             std::vector<std::string>& remarks);

/// Returns true if a "package://" or "file://" URI names a file of this machine.
bool isHere(const std::string& uri);

}  // namespace afterglow::nodes
