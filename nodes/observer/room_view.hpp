/// \file
/// A bystander's place in a room, and the room's own floor and walls. One YAML file;
/// assets/demo/view.yaml explains every key.
///
/// The things in a room, as solids that light falls on: things from messages, the robot, and the
/// surfaces that a scene knows of.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nodes/fetch/robot_model.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "nodes/projector/projector_config.hpp"
#include "render/gl/observer_renderer.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// A place to look from. Fixed frame.
struct Look {
  Eigen::Vector3d p_eye = Eigen::Vector3d::Zero(), p_target = Eigen::Vector3d::UnitX();
  double vertical_fov = 0.8;  ///< radians
};
/// The place of a bystander, and the one they go to while something is lit.
struct Place {
  Look look;
  std::optional<Look> near = {};
  std::string near_frame =
      {};  ///< frame in which `near` counts; empty: the fixed frame
};
/// Interpolates from a place (0) to another (1).
Look between(const Look& from, const Look& to, double share);

struct RoomView {
  std::string fixed_frame;
  int width = 1280, height = 720;       ///< the images' size, pixels
  Place place;                          ///< first place of a bystander
  std::map<std::string, Place> others;  ///< other places, by name
  std::vector<render::Drawable> shell;  ///< floor and walls
};

/// Returns the view from there; World is the fixed frame.
render::ObserverView viewFrom(const Look& look, int width, int height);

/// Makes a room that nobody has described: floor, and two walls behind these places (fixed frame),
/// seen from the left of somebody who looks along `ahead` (any length), from so far away that they
/// are in the picture.
RoomView roomAround(const std::string& fixed_frame,
                    const std::vector<Eigen::Vector3d>& p_world_places,
                    const Eigen::Vector3d& ahead);

/// Throws std::runtime_error "FILE:LINE: what is wrong" for a key that is unknown, missing or given
/// twice, and for a value of the wrong type or out of range.
RoomView loadRoomView(const std::string& path);

/// Configures a ProjectorScene that holds the room's things: /room/solids, a MarkerArray.
ProjectorConfig roomSolidsConfig(const std::string& fixed_frame);
std::vector<render::Drawable> solidsOf(const render::Scene& scene);

/// The links that tf has a place for.
std::vector<render::Drawable> robotSolids(const RobotModel& robot, FrameLookup& frames);

/// Level, at the height of the world's origin.
bool isFloor(const render::SurfacePatch& surface);

/// Every surface of the scene and of its layers as a slab under its plane, or its measured relief.
/// An unbounded one reaches 6 m around `p_world_middle`.
std::vector<render::Drawable> surfaceSolids(const render::Scene& scene,
                                            const Eigen::Vector3d& p_world_middle);

}  // namespace afterglow::nodes
