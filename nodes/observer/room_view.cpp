#include "nodes/observer/room_view.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <utility>

#include "nodes/projector/layer_config.hpp"
#include "render/gl/observer_renderer.hpp"
#include "render/scene/relief.hpp"
#include "render/scene/triangulate.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kFarthest_m = 100;
constexpr double kShellThickness_m = 0.1;  // of floor and walls: light does not come through
constexpr double kJoint_m = 0.010;         // between tiles
constexpr int kMostPixels = 4096;          // in one direction
constexpr double kMostTiles = 40'000;

// Of a room that nobody has described.
constexpr double kToWall_m = 2, kWallHeight_m = 4.5, kTile_m = 0.5;  // nothing is seen above
constexpr double kAside_m = 8;  // of floor and walls, beyond what is in the picture
constexpr double kNearest_m = 2.1, kEyeHeight_m = 1.75, kTargetHeight_m = 0.65;
constexpr double kAside = 1.45;      // rad, from where the light points
constexpr double kAroundFov = 0.75;  // rad
constexpr int kAroundHeight = 648;   // pixels; 720 with captions below
const render::Color kFloorPaint{0.80f, 0.79f, 0.76f, 1}, kJointPaint{0.60f, 0.59f, 0.57f, 1},
    kWarmPaint{0.85f, 0.84f, 0.79f, 1}, kColdPaint{0.80f, 0.83f, 0.85f, 1};

std::vector<double> numbersOf(const YamlMap& map, const std::string& key, std::size_t count) {
  return map.numbers(map.at(key), "'" + key + "' of " + map.where(), count);
}

/// The eye's optical frame: z toward the target, y down.
Rigid<World, Observer> eyeAt(const Eigen::Vector3d& p_eye, const Eigen::Vector3d& p_target) {
  const Eigen::Vector3d forward = (p_target - p_eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Isometry3d T_world_eye = Eigen::Isometry3d::Identity();
  T_world_eye.linear() << right, forward.cross(right), forward;
  T_world_eye.translation() = p_eye;
  return Rigid<World, Observer>(T_world_eye);
}

Look lookOf(const YamlMap& map) {
  Look look;
  look.p_eye = Eigen::Vector3d(numbersOf(map, "eye", 3).data());
  look.p_target = Eigen::Vector3d(numbersOf(map, "target", 3).data());
  if ((look.p_target - look.p_eye).head<2>().norm() < 1e-3) {
    map.fail(map.at("target"), "'target' should not be straight above or below 'eye'");
  }
  look.vertical_fov = map.number("vertical_fov", 1, 150) * M_PI / 180;
  return look;
}

Place placeOf(const std::string& path, const YamlMap& map) {
  Place place{lookOf(map)};
  if (map.has("near")) {
    const YamlMap near(path, map.at("near"), "'near' of " + map.where(),
                       {"frame", "eye", "target", "vertical_fov"});
    place.near = lookOf(near);
    if (near.has("frame")) place.near_frame = near.text("frame");
  }
  return place;
}

void readSize(const YamlMap& map, RoomView& room) {
  const Eigen::Vector2d size(numbersOf(map, "size", 2).data());
  if (size.minCoeff() < 16 || size.maxCoeff() > kMostPixels ||
      size != size.array().round().matrix()) {
    map.fail(map.at("size"), "'size' should be two whole numbers of pixels from 16 to 4096");
  }
  room.width = static_cast<int>(size.x());
  room.height = static_cast<int>(size.y());
}

void readOthers(const std::string& path, const YamlMap& map, RoomView& room) {
  const YAML::Node others = map.at("others");
  if (!others.IsMap()) map.fail(others, "'others' should map names to places");
  for (const auto& entry : others) {
    const std::string& name = entry.first.Scalar();
    room.others[name] = placeOf(
        path,
        {path, entry.second, "place '" + name + "'", {"eye", "target", "vertical_fov", "near"}});
  }
}

render::Drawable box(const Eigen::Isometry3d& pose, const Eigen::Vector3d& size,
                     const render::Color& color) {
  return {Rigid<World, World>(pose), render::Cube{size.cast<float>()}, color};
}

/// No two tiles are fired alike: up to 2.5 % lighter or darker, by their place.
render::Color shade(const render::Color& color, int column, int row) {
  const auto hash = static_cast<std::uint32_t>(column) * 73856093u ^
                    static_cast<std::uint32_t>(row) * 19349663u;
  const float tone = 1 + 0.05f * (static_cast<float>((hash * 2654435761u) >> 24) / 255.0f - 0.5f);
  const auto toned = [tone](float part) { return std::min(1.0f, part * tone); };
  return {toned(color.r), toned(color.g), toned(color.b), 1};
}

render::Drawable tiles(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, double edge,
                       const render::Color& color) {
  render::PointList points;
  render::ColorList colors;
  for (int row = 0; row * edge < size.y(); ++row) {
    for (int column = 0; column * edge < size.x(); ++column) {
      const Eigen::Vector2d low = corner + Eigen::Vector2d(column * edge, row * edge) +
                                  Eigen::Vector2d::Constant(kJoint_m / 2);
      const Eigen::Vector2d high =
          (low + Eigen::Vector2d::Constant(edge - kJoint_m)).cwiseMin(corner + size);
      const Eigen::Vector3f a(static_cast<float>(low.x()), static_cast<float>(low.y()), 0),
          c(static_cast<float>(high.x()), static_cast<float>(high.y()), 0), b(c.x(), a.y(), 0),
          d(a.x(), c.y(), 0);
      points.insert(points.end(), {a, b, c, a, c, d});
      colors.insert(colors.end(), 2, shade(color, column, row));
    }
  }
  return {{}, render::Triangles{std::move(points), std::move(colors)}, {}};
}

void addFloor(const Eigen::Vector2d& center, const Eigen::Vector2d& size, double edge,
              const render::Color& color, const render::Color& joints,
              std::vector<render::Drawable>& shell) {
  // What shows between the tiles lies a little lower.
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() << center, -kShellThickness_m / 2 - 0.003;
  shell.push_back(box(pose, {size.x(), size.y(), kShellThickness_m}, joints));
  shell.push_back(tiles(center - size / 2, size, edge, color));
}

void readFloor(const YamlMap& map, std::vector<render::Drawable>& shell) {
  const Eigen::Vector2d center(numbersOf(map, "center", 2).data());
  const Eigen::Vector2d size(numbersOf(map, "size", 2).data());
  if (size.minCoeff() <= 0 || size.maxCoeff() > kFarthest_m) {
    map.fail(map.at("size"), "the floor's 'size' should be two lengths of up to 100 m");
  }
  const double edge = map.number("tile", 0.05, kFarthest_m);
  if (size.prod() / (edge * edge) > kMostTiles) {
    map.fail(map.at("tile"), "more than 40000 tiles on the floor");
  }
  const render::Color joints = readPlainColor(map, "joint_color");
  addFloor(center, size, edge, readPlainColor(map, "color"), joints, shell);
}

void addWall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double height,
             const render::Color& color, std::vector<render::Drawable>& shell) {
  const Eigen::Vector2d along = to - from;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() << (from + to) / 2, height / 2;
  pose.rotate(Eigen::AngleAxisd(std::atan2(along.y(), along.x()), Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d wall(along.norm(), kShellThickness_m, height);
  shell.push_back(box(pose, wall, color));
}

void readWall(const YamlMap& map, std::vector<render::Drawable>& shell) {
  const Eigen::Vector2d from(numbersOf(map, "from", 2).data()), to(numbersOf(map, "to", 2).data());
  const double length = (to - from).norm();
  if (length < 0.01 || length > kFarthest_m) {
    map.fail(map.at("to"), "a wall should be 0.01 to 100 m long");
  }
  const double height = map.number("height", 0.01, kFarthest_m);
  addWall(from, to, height, readPlainColor(map, "color"), shell);
}

/// Adds floor and walls behind the places, as seen from `p_eye`.
void addRoom(const Eigen::AlignedBox2d& places, const Eigen::Vector2d& p_eye, RoomView& room) {
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(kToWall_m), middle = places.center();
  const Eigen::AlignedBox2d inside(places.min() - margin, places.max() + margin);
  const Eigen::Vector2d aside = Eigen::Vector2d::Constant(kAside_m);
  const Eigen::AlignedBox2d around_eye(p_eye - aside, p_eye + aside);
  const Eigen::AlignedBox2d floor = inside.merged(around_eye);
  const double tile = std::max(kTile_m, floor.sizes().maxCoeff() / 100);
  addFloor(floor.center(), floor.sizes(), tile, kFloorPaint, kJointPaint, room.shell);
  const Eigen::Vector2d corner(p_eye.x() < middle.x() ? inside.max().x() : inside.min().x(),
                               p_eye.y() < middle.y() ? inside.max().y() : inside.min().y());
  addWall({corner.x(), floor.min().y()}, {corner.x(), floor.max().y()}, kWallHeight_m, kWarmPaint,
          room.shell);
  addWall({floor.min().x(), corner.y()}, {floor.max().x(), corner.y()}, kWallHeight_m, kColdPaint,
          room.shell);
}

}  // namespace

Look between(const Look& from, const Look& to, double share) {
  return {from.p_eye + share * (to.p_eye - from.p_eye),
          from.p_target + share * (to.p_target - from.p_target),
          from.vertical_fov + share * (to.vertical_fov - from.vertical_fov)};
}

render::ObserverView viewFrom(const Look& look, int width, int height) {
  return {eyeAt(look.p_eye, look.p_target), width, height, look.vertical_fov};
}

RoomView roomAround(const std::string& fixed_frame,
                    const std::vector<Eigen::Vector3d>& p_world_places,
                    const Eigen::Vector3d& ahead) {
  Eigen::AlignedBox2d places;
  for (const Eigen::Vector3d& place : p_world_places) places.extend(place.head<2>());
  if (places.isEmpty()) places.extend(Eigen::Vector2d(0, 0));
  const bool has_heading = ahead.head<2>().norm() > 1e-3;
  const Eigen::Vector2d heading =
      has_heading ? Eigen::Vector2d(ahead.head<2>().normalized()) : Eigen::Vector2d(1, 0);
  const double distance = kNearest_m + 0.45 * places.diagonal().norm();
  const Eigen::Vector2d p_eye =
      places.center() + distance * (Eigen::Rotation2Dd(kAside) * heading);
  RoomView room;
  room.fixed_frame = fixed_frame;
  room.height = kAroundHeight;
  Look& look = room.place.look;
  look.p_eye << p_eye, kEyeHeight_m;
  look.p_target << places.center(), kTargetHeight_m;
  look.vertical_fov = kAroundFov;
  addRoom(places, p_eye, room);
  return room;
}

RoomView loadRoomView(const std::string& path) {
  const YamlMap map(
      path, loadYaml(path), "the view",
      {"fixed_frame", "eye", "target", "vertical_fov", "near", "size", "others", "floor", "walls"});
  RoomView room;
  room.fixed_frame = map.text("fixed_frame");
  room.place = placeOf(path, map);
  readSize(map, room);
  if (map.has("others")) readOthers(path, map, room);
  readFloor(
      {path, map.at("floor"), "the floor", {"center", "size", "color", "tile", "joint_color"}},
      room.shell);
  const YAML::Node walls = map.at("walls");
  if (!walls.IsSequence()) map.fail(walls, "'walls' should be a list");
  for (std::size_t i = 0; i < walls.size(); ++i) {
    readWall({path, walls[i], "wall " + std::to_string(i + 1), {"from", "to", "height", "color"}},
             room.shell);
  }
  return room;
}

namespace {

constexpr double kReach_m = 6;
constexpr double kFloorHeight_m = 0.02;
constexpr float kSlabThickness_m = 0.03f;
/// Things that stand on a surface, or are its table, share its plane: they are in front.
constexpr float kBelow_m = 0.001f;

render::Color paintOf(const render::SurfacePatch& surface) {
  return isFloor(surface) ? render::Color{0.80f, 0.79f, 0.76f, 1}
                          : render::kWoodPaint;
}

Eigen::Vector3f at(const Eigen::Vector2d& p, float z) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), z};
}

render::Outline outlineOf(const render::SurfacePatch& surface, const Eigen::Vector3d& p_world) {
  render::Outline outline = surface.polygon;
  if (outline.empty()) {
    const Eigen::Vector2d middle = (surface.T_world_surface.inverse() * p_world).head<2>();
    for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
      outline.emplace_back(middle + kReach_m * Eigen::Vector2d(x, y));
    }
  }
  if (render::signedArea(outline) < 0) std::reverse(outline.begin(), outline.end());
  return outline;
}

render::Triangles slab(const render::Outline& outline) {
  const float top = -kBelow_m, bottom = top - kSlabThickness_m;
  render::PointList slab;
  for (const auto& t : render::triangulate(outline, {})) {
    for (const std::uint32_t i : t) slab.push_back(at(outline[i], top));
    for (const std::uint32_t i : {t[0], t[2], t[1]}) slab.push_back(at(outline[i], bottom));
  }
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
    for (const auto& p :
         {at(a, bottom), at(b, bottom), at(b, top), at(a, bottom), at(b, top), at(a, top)}) {
      slab.push_back(p);
    }
  }
  return {std::move(slab), {}};
}

render::Triangles landscape(const render::Relief& relief) {
  render::PointList land;
  const auto node = [&](int column, int row) {
    return at(relief.origin() + relief.cell() * Eigen::Vector2d(column, row),
              relief.node(column, row) - kBelow_m);
  };
  for (int row = 0; row + 1 < relief.rows(); ++row) {
    for (int column = 0; column + 1 < relief.columns(); ++column) {
      const Eigen::Vector3f a = node(column, row), b = node(column + 1, row),
                            c = node(column + 1, row + 1), d = node(column, row + 1);
      if (!std::isfinite(a.z() + b.z() + c.z() + d.z())) continue;
      land.insert(land.end(), {a, b, c, a, c, d});
    }
  }
  return {std::move(land), {}};
}

}  // namespace

bool isFloor(const render::SurfacePatch& surface) {
  const Eigen::Isometry3d& T = surface.T_world_surface.matrix();
  return std::abs(T.translation().z()) < kFloorHeight_m && T.linear()(2, 2) > 0.999;
}

ProjectorConfig roomSolidsConfig(const std::string& fixed_frame) {
  LayerConfig solids;
  solids.topic = "/room/solids";
  solids.type = LayerType::MarkerArray;
  ProjectorConfig config;
  config.fixed_frame = fixed_frame;
  config.layers = {solids};
  return config;
}

std::vector<render::Drawable> solidsOf(const render::Scene& scene) {
  std::vector<render::Drawable> solids;
  for (const render::Layer& layer : scene.layers) {
    solids.insert(solids.end(), layer.drawables.begin(), layer.drawables.end());
  }
  return solids;
}

std::vector<render::Drawable> robotSolids(const RobotModel& robot, FrameLookup& frames) {
  LinkPoses T_world_link;
  for (const LinkVisual& visual : robot.visuals()) {
    if (const auto pose = frames.at(visual.link, ros::Time(0))) T_world_link[visual.link] = *pose;
  }
  return robot.drawables(T_world_link);
}

std::vector<render::Drawable> surfaceSolids(const render::Scene& scene,
                                            const Eigen::Vector3d& p_world_middle) {
  std::vector<render::SurfacePatch> surfaces = scene.surfaces;
  for (const render::Layer& layer : scene.layers) {
    const auto same = [&](const auto& known) { return known.name == layer.surface->name; };
    if (layer.surface && std::none_of(surfaces.begin(), surfaces.end(), same)) {
      surfaces.push_back(*layer.surface);
    }
  }
  std::vector<render::Drawable> solids;
  for (const render::SurfacePatch& surface : surfaces) {
    solids.push_back(
        {Rigid<World, World>(surface.T_world_surface.matrix()),
         surface.relief ? landscape(*surface.relief) : slab(outlineOf(surface, p_world_middle)),
         paintOf(surface)});
  }
  return solids;
}

}  // namespace afterglow::nodes
