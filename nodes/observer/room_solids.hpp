/// \file
/// The things in a room, as solids that light falls on: things from messages, the robot, and the
/// surfaces that a scene knows of.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "nodes/conversion/mesh_library.hpp"
#include "nodes/fetch/robot_model.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "nodes/projector/projector_config.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// Configures a ProjectorScene that holds the room's things: /room/solids, a MarkerArray.
ProjectorConfig roomSolidsConfig(const std::string& fixed_frame);
std::vector<render::Drawable> solidsOf(const render::Scene& scene);

/// Reads a robot's meshes by a library that outlives it. `tell` hears why one is left out.
MeshReader robotMeshes(MeshLibrary& library, std::function<void(const std::string& why)> tell);

/// The links that tf has a place for.
std::vector<render::Drawable> robotSolids(const RobotModel& robot, FrameLookup& frames);

/// Level, at the height of the world's origin.
bool isFloor(const render::SurfacePatch& surface);

/// Every surface of the scene and of its layers as a slab under its plane, or its measured relief.
/// An unbounded one reaches 6 m around `p_world_middle`.
std::vector<render::Drawable> surfaceSolids(const render::Scene& scene,
                                            const Eigen::Vector3d& p_world_middle);

}  // namespace afterglow::nodes
