/// \file
/// The room of a recorded behavior at any of its moments. No ROS master is involved.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nodes/fetch/robot_model.hpp"
#include "nodes/projector/recorded_scene.hpp"

namespace afterglow::nodes {

/// Keeps a reference to the store. One thread at a time.
class RecordedRoom {
 public:
  RecordedRoom(const replay::Store& store, replay::Behavior behavior,
               const std::string& fixed_frame, std::optional<RobotModel> robot);

  /// What was on /room/solids, if it was recorded, and the robot's links where tf had them. Moments
  /// must not decrease. Throws as RecordedScene::at does.
  std::vector<render::Drawable> solids(replay::Stamp moment);

 private:
  RecordedScene scene_;
  FrameLookup frames_;
  std::optional<RobotModel> robot_;
};

}  // namespace afterglow::nodes
