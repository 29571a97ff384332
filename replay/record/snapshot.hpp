/// \file
/// The world that a behavior was recorded in: Behavior::snapshot.
///
/// A JSON object; members that are not known are absent.
///   "frames": {"begin": {"map->odom": [x, y, z, qx, qy, qz, qw], ...}, "end": {...}}
///             "A->B": the pose of frame B in frame A, meters and a unit quaternion, between
///             neighbors of the configured anchors that tf connected then. What moved in between
///             is in the recorded /tf.
///   "urdf":   SHA-256 of the text of /robot_description; the text is a file of the store
///   "map":    SHA-256 of the map that the robot was localized on, /map; absent without one, and
///             where it changed meanwhile
///   "robot":  {"namespace": "/robot1", "tf_prefix": "robot1"}: the names of the recorder's robot,
///             which are empty where it is alone; absent in imports, and in recordings of before
///   "files":  {"package://NAME/PATH" or "file:///PATH": SHA-256}: sounds and meshes that recorded
///             messages refer to, as they were; files of the store
///   "request": {"topics": ["/cmd_vel", ...]}: those that the recording's request named one by one,
///             and not by a pattern or as all; absent in imports, and in recordings of before
///   "nodes":  {"/cmd_vel": {"type": "geometry_msgs/Twist", "publishers": ["/move_base"],
///             "subscribers": ["/base"]}, ...}: who sent on a topic (if nothing came: who announced
///             it), and who heard it at the begin or the end, without the recorder; of recorded
///             topics, and of others that tell who drove. Imports know the senders alone, and
///             recordings of before nothing.
///   "notes":  ["the gripper slipped", ...]: what people wrote later (store/behavior_edit.hpp)
#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/messages/topic_name.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// The nodes around a topic when it was recorded.
struct TopicNodes {
  std::string type;  ///< empty: not known
  std::set<std::string> publishers, subscribers;
};
/// Nodes by topic.
using RecordedNodes = std::map<std::string, TopicNodes>;

struct Snapshot {
  using Pose = std::array<double, 7>;  ///< x, y, z, qx, qy, qz, qw
  using Frames = std::map<std::string, Pose>;

  Frames begin, end;
  std::string urdf;
  std::string map;
  std::optional<RobotNames> robot;
  std::map<std::string, std::string> files;
  std::vector<std::string> requested;
  RecordedNodes nodes;

  std::string toJson() const;
};

/// SHA-256 of the robot's description, a file of the store: Snapshot::urdf; empty: none was kept.
std::string recordedUrdf(const Behavior& behavior);

/// Returns the map that it was: Snapshot::map; empty: not known.
std::string recordedMap(const Behavior& behavior);

/// The names of the robot that was recorded: Snapshot::robot.
std::optional<RobotNames> recordedRobot(const Behavior& behavior);

/// The topics that the recording's request named one by one: Snapshot::requested.
std::vector<std::string> requestedTopics(const Behavior& behavior);

/// Snapshot::nodes; empty: nothing was noted.
RecordedNodes recordedNodes(const Behavior& behavior);

/// Adds the nodes of the others.
void addNodes(RecordedNodes& nodes, const RecordedNodes& others);

}  // namespace afterglow::replay
