#include "nodes/observer/recorded_room.hpp"

#include <utility>

#include "nodes/observer/room_solids.hpp"

namespace afterglow::nodes {

RecordedRoom::RecordedRoom(const replay::Store& store, replay::Behavior behavior,
                           const std::string& fixed_frame, std::optional<RobotModel> robot)
    : scene_(store, std::move(behavior), roomSolidsConfig(fixed_frame)),
      frames_(scene_.transforms(), fixed_frame),
      robot_(std::move(robot)) {}

std::vector<render::Drawable> RecordedRoom::solids(replay::Stamp moment) {
  std::vector<render::Drawable> all = solidsOf(scene_.at(moment).scene);
  frames_.forget();
  if (!robot_) return all;
  const auto robot = robotSolids(*robot_, frames_);
  all.insert(all.end(), robot.begin(), robot.end());
  return all;
}

}  // namespace afterglow::nodes
