/// \file
/// Private parameters of recorder_node; launch/recorder.launch explains them.
#pragma once

#include <ros/ros.h>

#include <cstdint>
#include <string>
#include <vector>

namespace afterglow::nodes {

/// Topics may be relative to the node's namespace, which is the robot's.
struct RecorderNodeOptions {
  std::string store;  ///< ~store, as openStore() takes it
  std::string robot;  ///< ~robot
  /// ~context_topics: recorded along with every behavior. Transforms are everybody's.
  std::vector<std::string> context_topics = {"/tf", "/tf_static", "joint_states", "odom"};
  double connect_timeout_s = 2.0;  ///< ~connect_timeout: waits no longer for publishers
  double rescan_s = 0.25;          ///< ~rescan: looks for new topics so often
  int queue_megabytes = 256;       ///< ~queue_megabytes: of messages that wait for the store
  double pre_roll_s = 10;          ///< ~pre_roll: how far a behavior can reach back
  int pre_roll_megabytes = 64;     ///< ~pre_roll_megabytes: of messages remembered for that
  /// ~pre_roll_topics: listened to always, so that a behavior can reach back on them.
  std::vector<std::string> pre_roll_topics;
  int min_space_megabytes = 1024;  ///< ~min_space, MiB: ends recordings below it; 0: never
  /// The way out of a full disk, for whoever cannot record.
  std::string space_advice = "make room, or set another ~min_space or ~store";
  /// ~anchors: frames between which poses are kept with every behavior, without tf_prefix.
  std::vector<std::string> anchors = {"map", "odom", "base_link", "projector_optical_frame"};
  std::string calibration;  ///< ~calibration: folder of the calibration in use
  /// ~file_roots: sounds and meshes that messages name by file:// are kept from these folders.
  std::vector<std::string> file_roots;
  std::string camera_info = "projector/camera_info";  ///< ~camera_info: or where it is latched
  std::string map_topic = "/map";  ///< ~map_topic: the map that the robot is localized on
  double retention_days = 0;           ///< ~retention_days: older behaviors make room; 0: none
  double retention_gigabytes = 0;      ///< ~retention_gigabytes: of the store; 0: any size
  std::vector<std::string> keep_tags;  ///< ~keep_tags: behaviors with one of these stay
  bool mongodb_logger = true;          ///< ~mongodb_logger: serves the action of that name

  /// Throws std::runtime_error naming the parameter that is wrong.
  static RecorderNodeOptions read(const ros::NodeHandle& private_node);
  /// All topics as ROS resolves them here.
  RecorderNodeOptions resolved() const;
};

}  // namespace afterglow::nodes
