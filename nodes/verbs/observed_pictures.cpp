#include "nodes/verbs/observed_pictures.hpp"

#include <fmt/format.h>

#include <iostream>
#include <stdexcept>
#include <utility>

#include "calib/number_text.hpp"
#include "nodes/conversion/mesh_library.hpp"
#include "nodes/observer/room_solids.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kVerticalFov = 0.75;  // radians; a picture on a wall is seen so

Eigen::Vector3d pointOf(const std::string& option, const std::string& text) {
  Eigen::Vector3d point;
  std::string rest = text + ",";
  for (int i = 0; i < 3; ++i) {
    const std::size_t comma = rest.find(',');
    const auto number = calib::numberFromText(rest.substr(0, comma));
    const bool is_last = comma == std::string::npos || comma + 1 == rest.size();
    if (!number || is_last != (i == 2)) {
      throw std::runtime_error(option + " should be x,y,z in meters, not '" + text + "'");
    }
    point[i] = *number;
    rest.erase(0, comma + 1);
  }
  return point;
}

Look placeIn(const RoomView& room, const ObserverOptions& options) {
  if (options.place.empty()) return room.look;
  const auto found = room.others.find(options.place);
  if (found != room.others.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [name, look] : room.others) names.push_back(name);
  throw std::runtime_error(fmt::format("{}: has no place '{}' to look from; it has: {}",
                                       options.room, options.place, fmt::join(names, ", ")));
}

RoomView roomViewOf(const ProjectorConfig& config, const ObserverOptions& options) {
  RoomView room;
  room.fixed_frame = config.fixed_frame;
  room.look.vertical_fov = kVerticalFov;
  if (!options.room.empty()) {
    room = loadRoomView(options.room);
    if (room.fixed_frame != config.fixed_frame) {
      throw std::runtime_error(options.room + ": is of the frame '" + room.fixed_frame +
                               "', the configuration of '" + config.fixed_frame + "'");
    }
    room.look = placeIn(room, options);
  } else if (options.eye.empty()) {
    throw std::runtime_error(
        "--view observer needs to know where from: --eye x,y,z and --look-at x,y,z, or --room");
  }
  if (options.eye.empty()) return room;
  room.look.p_eye = pointOf("--eye", options.eye);
  room.look.p_target = pointOf("--look-at", options.look_at);
  if ((room.look.p_target - room.look.p_eye).head<2>().norm() < 1e-3) {
    throw std::runtime_error("--look-at should not be straight above or below --eye");
  }
  return room;
}

std::optional<RobotModel> robotOf(const ProjectorConfig& config, const std::string& urdf) {
  if (urdf.empty()) return std::nullopt;
  MeshLibrary meshes(config.mesh_roots);
  return RobotModel::fromFile(urdf, [&](const std::string& resource) -> render::SharedBody {
    auto mesh = meshes.get(resource);
    if (mesh.value) return *mesh.value;
    std::cerr << "afterglow render: " << urdf << ": " << mesh.reason << std::endl;
    return nullptr;
  });
}

/// The scene's surfaces without floors, for a room that has its own.
render::Scene withoutFloors(const render::Scene& scene) {
  render::Scene others;
  const auto keep = [&](const render::SurfacePatch& surface) {
    if (!isFloor(surface)) others.surfaces.push_back(surface);
  };
  for (const render::SurfacePatch& surface : scene.surfaces) keep(surface);
  for (const render::Layer& layer : scene.layers) {
    if (layer.surface) keep(*layer.surface);
  }
  return others;
}

}  // namespace

void addObserverOptions(CLI::App& verb, ObserverOptions& options) {
  const std::string group = "Of --view observer";
  CLI::Option* eye =
      verb.add_option("--eye", options.eye, "Where from: x,y,z in the fixed frame, meters")
          ->group(group);
  CLI::Option* look_at = verb.add_option("--look-at", options.look_at, "Where to: x,y,z");
  look_at->group(group)->needs(eye);
  eye->needs(look_at);
  CLI::Option* room =
      verb.add_option("--room", options.room,
                      "Floor, walls and places to look from (assets/demo/view.yaml)")
          ->group(group);
  verb.add_option("--place", options.place, "One of the room's places")
      ->group(group)
      ->needs(room)
      ->excludes(eye);
  verb.add_option("--urdf", options.urdf, "The robot, drawn where the recorded tf has its links")
      ->group(group);
}

ObservedPictures::ObservedPictures(render::GlContext& context, const replay::Store& store,
                                   const replay::Behavior& behavior, const ProjectorConfig& config,
                                   const ObserverOptions& options)
    : room_view_(roomViewOf(config, options)),
      room_(store, behavior, roomSolidsConfig(config.fixed_frame)),
      frames_(room_.transforms(), config.fixed_frame),
      robot_(robotOf(config, options.urdf)),
      renderer_(context) {}

std::vector<render::Drawable> ObservedPictures::solids(replay::Stamp moment,
                                                       const SceneSnapshot& snapshot) {
  std::vector<render::Drawable> all = room_view_.shell;
  const auto add = [&all](const std::vector<render::Drawable>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  const Eigen::Vector3d p_world_projector =
      snapshot.T_projector_world ? snapshot.T_projector_world->inverse().matrix().translation()
                              : Eigen::Vector3d(room_view_.look.p_target);
  add(surfaceSolids(room_view_.shell.empty() ? snapshot.scene : withoutFloors(snapshot.scene),
                    p_world_projector));
  add(solidsOf(room_.at(moment).scene));
  frames_.forget();
  if (robot_) add(robotSolids(*robot_, frames_));
  return all;
}

render::Image ObservedPictures::see(replay::Stamp moment, const SceneSnapshot& snapshot,
                                    const calib::Lens& lens, render::Image projected) {
  const render::ObserverView view = viewFrom(room_view_.look, room_view_.width, room_view_.height);
  const std::vector<render::Drawable> all = solids(moment, snapshot);
  if (!snapshot.T_projector_world) return renderer_.render(all, nullptr, view);
  const render::ProjectedLight light{lens, *snapshot.T_projector_world, std::move(projected)};
  return renderer_.render(all, &light, view);
}

}  // namespace afterglow::nodes
