#include "nodes/behavior_view/observed_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <stdexcept>
#include <utility>

#include "calib/number_text.hpp"
#include "nodes/observer/room_solids.hpp"
#include "nodes/player/robot_description.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kVerticalFov = 0.75;  // radians; a picture on a wall is seen so
constexpr int kLooks = 40;             // at a recording, to see where it took place
constexpr double kFarthestLight_m = 3;
constexpr double kWalk_s = 1.4;  // that a bystander takes to come near, and back

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

Place placeIn(const RoomView& room, const ObserverOptions& options) {
  if (options.place.empty()) return room.place;
  const auto found = room.others.find(options.place);
  if (found != room.others.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [name, place] : room.others) names.push_back(name);
  throw std::runtime_error(fmt::format("{}: has no place '{}' to look from; it has: {}",
                                       options.room, options.place, fmt::join(names, ", ")));
}

/// Returns a view from where the projector was to where the middle of its image pointed, on the
/// floor or before it.
RoomView roomOfRecording(const replay::Store& store, const replay::Behavior& behavior,
                         const ProjectorConfig& config, const calib::Lens& lens) {
  const auto ray = calib::unproject(lens, {(lens.width - 1) / 2.0, (lens.height - 1) / 2.0});
  std::vector<Eigen::Vector3d> places;
  Eigen::Vector3d ahead = Eigen::Vector3d::Zero();
  RecordedScene scene(store, behavior, config);
  const std::int64_t last_ns = endOf(store, behavior).ns - 1;
  const std::int64_t step_ns = std::max<std::int64_t>(1, (last_ns - behavior.begin.ns) / kLooks);
  for (std::int64_t ns = behavior.begin.ns; ns <= last_ns; ns += step_ns) {
    const auto T_projector_world = scene.at({ns}).T_projector_world;
    if (!T_projector_world) continue;
    const Eigen::Isometry3d T_world_projector = T_projector_world->inverse().matrix();
    const Eigen::Vector3d p = T_world_projector.translation();
    const Eigen::Vector3d to =
        T_world_projector.linear() * ray.value_or(Eigen::Vector3d::UnitZ()).normalized();
    const double to_floor = to.z() < 0 ? std::max(0.0, p.z() / -to.z()) : kFarthestLight_m;
    places.push_back(p);
    places.emplace_back(p + std::min(to_floor, kFarthestLight_m) * to);
    ahead += to;
  }
  return roomAround(config.fixed_frame, places, ahead);
}

/// Returns the room as it is described, or with no floor and walls of its own if only the eye's
/// place is given.
RoomView givenRoom(const ProjectorConfig& config, const ObserverOptions& options) {
  RoomView room;
  room.fixed_frame = config.fixed_frame;
  room.place.look.vertical_fov = kVerticalFov;
  if (!options.room.empty()) {
    room = loadRoomView(options.room);
    if (room.fixed_frame != config.fixed_frame) {
      throw std::runtime_error(options.room + ": is of the frame '" + room.fixed_frame +
                               "', the configuration of '" + config.fixed_frame + "'");
    }
    room.place = placeIn(room, options);
  }
  if (options.eye.empty()) return room;
  Look& look = room.place.look;
  room.place.near.reset();
  look.p_eye = pointOf("--eye", options.eye);
  look.p_target = pointOf("--look-at", options.look_at);
  if ((look.p_target - look.p_eye).head<2>().norm() < 1e-3) {
    throw std::runtime_error("--look-at should not be straight above or below --eye");
  }
  return room;
}

std::optional<RobotModel> robotOf(const ProjectorConfig& config, const std::string& urdf,
                                  const std::string& recorded) {
  if (urdf.empty() && recorded.empty()) return std::nullopt;
  MeshLibrary meshes(config.mesh_roots);
  const std::string name = urdf.empty() ? "the recorded /robot_description" : urdf;
  const MeshReader read_mesh = robotMeshes(meshes, [&](const std::string& why) {
    std::cerr << "afterglow: " << name << ": " << why << std::endl;
  });
  if (!urdf.empty()) return RobotModel::fromFile(urdf, read_mesh);
  try {
    return RobotModel::fromXml(recorded, name, read_mesh);
  } catch (const std::runtime_error& error) {
    std::cerr << "afterglow render: the robot is not shown: " << error.what() << std::endl;
    return std::nullopt;
  }
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
  const std::string group = "Of --view observer and --film";
  CLI::Option* eye =
      verb.add_option("--eye", options.eye, "Where from: x,y,z in the fixed frame, meters")
          ->group(group);
  CLI::Option* look_at = verb.add_option("--look-at", options.look_at, "Where to: x,y,z");
  look_at->group(group)->needs(eye);
  eye->needs(look_at);
  CLI::Option* room =
      verb.add_option("--room", options.room,
                      "Floor, walls and places to look from (assets/demo/view.yaml); without it "
                      "and --eye, a room around what was recorded")
          ->group(group);
  verb.add_option("--place", options.place, "One of the room's places")
      ->group(group)
      ->needs(room)
      ->excludes(eye);
  verb.add_option("--urdf", options.urdf,
                  "The robot, drawn where the recorded tf has its links; without it, as it was "
                  "described when it was recorded")
      ->group(group);
}

ObservedPictures::ObservedPictures(render::GlContext& context, const replay::Store& store,
                                   const replay::Behavior& behavior, const ProjectorConfig& config,
                                   const calib::Lens& lens, const ObserverOptions& options)
    : store_(store),
      behavior_(behavior),
      fixed_frame_(config.fixed_frame),
      lens_(lens),
      room_view_((options.room + options.eye).empty()
                     ? roomOfRecording(store, behavior, config, lens)
                     : givenRoom(config, options)),
      robot_(robotOf(config, options.urdf, recordedDescription(store, behavior))),
      renderer_(context) {
  if (!options.size.empty()) {
    room_view_.width = options.size.at(0);
    room_view_.height = options.size.at(1);
  }
  restart();
}

void ObservedPictures::restart() {
  frames_.reset();
  last_.reset();
  room_.emplace(store_, behavior_, roomSolidsConfig(fixed_frame_));
  frames_.emplace(room_->transforms(), fixed_frame_);
}

std::vector<render::Drawable> ObservedPictures::solids(replay::Stamp moment,
                                                       const SceneSnapshot& snapshot) {
  std::vector<render::Drawable> all = room_view_.shell;
  const auto add = [&all](const std::vector<render::Drawable>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  const Eigen::Vector3d p_world_projector =
      snapshot.T_projector_world ? snapshot.T_projector_world->inverse().matrix().translation()
                                 : Eigen::Vector3d(room_view_.place.look.p_target);
  add(surfaceSolids(room_view_.shell.empty() ? snapshot.scene : withoutFloors(snapshot.scene),
                    p_world_projector));
  add(solidsOf(room_->at(moment).scene));
  frames_->forget();
  if (robot_) add(robotSolids(*robot_, *frames_));
  return all;
}

// The way begins and ends gently. A single picture is seen from where the bystander would have
// gone.
Look ObservedPictures::lookAt(replay::Stamp moment, bool is_lit) {
  const double walked = last_ ? static_cast<double>(moment.ns - last_->ns) * 1e-9 / kWalk_s : 1;
  closeness_ = std::clamp(closeness_ + (is_lit ? walked : -walked), 0.0, 1.0);
  last_ = moment;
  const Place& place = room_view_.place;
  Look near = place.near.value_or(place.look);
  if (!place.near_frame.empty()) {
    const auto T_world_frame = frames_->at(place.near_frame, ros::Time(0));
    if (!T_world_frame) return place.look;
    near.p_eye += T_world_frame->translation();
    near.p_target += T_world_frame->translation();
  }
  return between(place.look, near, closeness_ * closeness_ * (3 - 2 * closeness_));
}

render::Image ObservedPictures::seeAt(int width, int height, replay::Stamp moment,
                                      const SceneSnapshot& snapshot, render::Image projected) {
  const std::vector<render::Drawable> solids = this->solids(moment, snapshot);
  has_ghosts_ = std::any_of(solids.begin(), solids.end(),
                            [](const auto& solid) { return solid.color.a < 1; });
  const Look look = lookAt(moment, isLit(projected));
  std::optional<render::ProjectedLight> light;
  if (snapshot.T_projector_world) {
    light = render::ProjectedLight{lens_, *snapshot.T_projector_world, std::move(projected)};
  }
  return renderer_.render(solids, light ? &*light : nullptr, viewFrom(look, width, height));
}

}  // namespace afterglow::nodes
