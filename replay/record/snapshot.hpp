/// \file
/// The world that a behavior was recorded in: Behavior::snapshot.
///
/// A JSON object; members that are not known are absent.
///   "frames": {"begin": {"map->odom": [x, y, z, qx, qy, qz, qw], ...}, "end": {...}}
///             "A->B": the pose of frame B in frame A, meters and a unit quaternion, between
///             neighbors of the configured anchors that tf connected then. What moved in between
///             is in the recorded /tf.
///   "urdf":   SHA-256 of the text of /robot_description; the text is a file of the store
///   "files":  {"package://NAME/PATH" or "file:///PATH": SHA-256}: sounds and meshes that recorded
///             messages refer to, as they were; files of the store
///   "request": {"topics": ["/cmd_vel", ...]}: those that the recording's request named one by one,
///             and not by a pattern or as all; absent in imports, and in recordings of before
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

struct Snapshot {
  using Pose = std::array<double, 7>;  ///< x, y, z, qx, qy, qz, qw
  using Frames = std::map<std::string, Pose>;

  Frames begin, end;
  std::string urdf;
  std::map<std::string, std::string> files;
  std::vector<std::string> requested;

  std::string toJson() const;
};

/// The topics that the recording's request named one by one: Snapshot::requested.
std::vector<std::string> requestedTopics(const Behavior& behavior);

}  // namespace afterglow::replay
