#include "nodes/behavior_view/moment_painter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <utility>

#include "calib/number_text.hpp"
#include "nodes/observer/room_view.hpp"
#include "nodes/player/robot_description.hpp"
#include "nodes/projector/output_config.hpp"

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

namespace {

constexpr int kJpegQuality = 82;
constexpr int kLightLooks = 50;
constexpr std::chrono::seconds kLightPatience{2};
/// Light falls on a room of a given width in no more pixels than these.
constexpr int kWidestLight = 800;

/// Returns the configuration with one projector alone, the one of that name or the only one, or,
/// where light is shared, with that one first.
ProjectorConfig ofProjector(ProjectorConfig config, const std::string& name) {
  std::vector<std::string> names;
  for (auto projector = config.projectors.begin(); projector != config.projectors.end();
       ++projector) {
    if (projector->name == name || (name.empty() && config.projectors.size() == 1)) {
      std::rotate(config.projectors.begin(), projector, projector + 1);
      if (!config.blend) config.projectors.resize(1);
      return config;
    }
    if (!projector->name.empty()) names.push_back(projector->name);
  }
  const std::string known = fmt::format("{}", fmt::join(names, ", "));
  if (name.empty()) throw std::runtime_error("--projector is needed, one of: " + known);
  throw std::runtime_error("no projector '" + name + "' in the configuration" +
                           (known.empty() ? ", its only one has no name" : "; known: " + known));
}

calib::Lens drawnLens(const calib::Lens& lens, PictureView view, int width) {
  if (width == 0) return lens;
  const bool is_projector = view == PictureView::Projector;
  return lensOfWidth(lens, is_projector ? width : std::min(lens.width, kWidestLight));
}

std::unique_ptr<render::LightBlend> blendOf(const PictureSettings& settings,
                                            const calib::Lens& drawn) {
  if (!settings.config.blend) return nullptr;
  std::vector<render::BlendedProjector> projectors;
  for (const OutputConfig& projector : settings.config.projectors) {
    const std::size_t i = projectors.size();
    projectors.push_back(projector.blended(i == 0 ? drawn : settings.others[i - 1]));
  }
  return std::make_unique<render::LightBlend>(projectors, settings.config.blend->evens_black);
}

std::string jpegOf(const render::Image& image) {
  const cv::Mat rgb(image.height, image.width, CV_8UC3,
                    const_cast<std::uint8_t*>(image.rgb.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  return {bytes.begin(), bytes.end()};
}

}  // namespace

void addPictureOptions(CLI::App& verb, PictureOptions& options) {
  verb.add_option("--config", options.config,
                  "What is projected where (assets/projector.yaml), for pictures of moments");
  verb.add_option("--calibration", options.calibration,
                  "Folder of the lens's file; without it, the configuration's folder");
  verb.add_option("--projector", options.projector,
                  "Which of several projectors of the configuration");
  addObserverOptions(verb, options.observer);
}

PictureSettings readPictureSettings(const PictureOptions& options) {
  PictureSettings settings;
  settings.config =
      ofProjector(loadProjectorConfig(options.config, options.calibration), options.projector);
  const OutputConfig& projector = settings.config.projectors[0];
  calib::CameraInfoFile file = loadLens(projector);
  if (!file.warning.empty()) settings.remark = projector.camera_info + ": " + file.warning;
  settings.lens = std::move(file.lens);
  for (std::size_t i = 1; i < settings.config.projectors.size(); ++i) {
    settings.others.push_back(loadLens(settings.config.projectors[i]).lens);
  }
  settings.observer = options.observer;
  return settings;
}

calib::Lens lensOfWidth(const calib::Lens& lens, int width) {
  const double scale = static_cast<double>(width) / lens.width;
  Eigen::Matrix3d K = lens.K;
  K.topRows<2>() *= scale;
  // (0, 0) is the center of the first pixel.
  K(0, 2) = (lens.K(0, 2) + 0.5) * scale - 0.5;
  K(1, 2) = (lens.K(1, 2) + 0.5) * scale - 0.5;
  const int height = std::max(1, static_cast<int>(std::lround(lens.height * scale)));
  return calib::makeLens(width, height, K, calib::distortionCoefficients(lens), lens.model);
}

MomentPainter::MomentPainter(render::GlContext& context, const replay::Store& store,
                             const replay::Behavior& behavior, const PictureSettings& settings,
                             PictureView view, int width)
    : store_(store),
      behavior_(behavior),
      settings_(settings),
      width_(width),
      lens_(drawnLens(settings.lens, view, width)),
      last_{std::max(behavior.begin.ns, endOf(store, behavior).ns - 1)},
      light_(settings_.config.projectors.at(0).light, lens_, settings_.config.blend.has_value()),
      blend_(blendOf(settings_, lens_)),
      renderer_(context, lens_, settings_.config.projectors[0].drawing),
      census_(settings.lens),
      now_(behavior.begin) {
  scene_.emplace(store_, behavior_, settings_.config);
  if (view == PictureView::Bystander) {
    observed_.emplace(context, store_, behavior_, settings_.config, lens_, settings_.observer);
  }
}

void MomentPainter::restart() {
  scene_.emplace(store_, behavior_, settings_.config);
  if (observed_) observed_->restart();
}

int MomentPainter::width() const {
  return width_ > 0 ? width_ : observed_ ? observed_->width() : lens_.width;
}

int MomentPainter::height() const {
  return observed_ ? observed_->heightOf(width()) : lens_.height;
}

void MomentPainter::moveTo(replay::Stamp moment) {
  if (moment < now_) restart();
  now_ = moment;
  snapshot_ = scene_->at(moment);
  image_.reset();
}

void MomentPainter::moveTo(double t) {
  const double longest = static_cast<double>(last_.ns - behavior_.begin.ns) * 1e-9;
  const std::int64_t since_ns = std::llround(std::clamp(t, 0.0, longest) * 1e9);
  moveTo(replay::Stamp{std::min(last_.ns, behavior_.begin.ns + since_ns)});
}

std::optional<double> MomentPainter::moveToLight() {
  const auto end = std::chrono::steady_clock::now() + kLightPatience;
  const double length = static_cast<double>(last_.ns - behavior_.begin.ns) * 1e-9;
  for (int i = 0; i <= kLightLooks && std::chrono::steady_clock::now() < end; ++i) {
    const double t = length * i / kLightLooks;
    moveTo(t);
    if (hasContent() && isLit()) return t;
  }
  return std::nullopt;
}

bool MomentPainter::hasContent() const {
  const auto& layers = snapshot_.scene.layers;
  return snapshot_.T_projector_world &&
         std::any_of(layers.begin(), layers.end(),
                     [](const render::Layer& layer) { return !layer.drawables.empty(); });
}

const render::Image& MomentPainter::lensImage() {
  if (!image_) {
    // For an unknown projector the scene is empty: black.
    image_ = snapshot_.T_projector_world
                 ? renderer_.render(snapshot_.scene, *snapshot_.T_projector_world)
                 : renderer_.render({}, {});
  }
  return *image_;
}

std::vector<std::string> MomentPainter::whyDark(bool is_lit) {
  return scene_->whyDark(snapshot_, census_, is_lit);
}

render::Image MomentPainter::projected() {
  render::Image image = lensImage();
  if (!snapshot_.T_projector_world) return image;
  const render::PixelLight* light = nullptr;
  if (blend_) {
    auto poses = snapshot_.T_others_world;
    poses.insert(poses.begin(), snapshot_.T_projector_world);
    blend_->update(snapshot_.scene.surfaces, poses);
    light = &blend_->light(0);
  }
  light_.apply(image, snapshot_.scene.surfaces, *snapshot_.T_projector_world, light);
  return image;
}

render::Image MomentPainter::picture() { return observed_ ? room(width(), height()) : projected(); }

render::Image MomentPainter::room(int width, int height) {
  return observed_.value().seeAt(width, height, now_, snapshot_, lensImage());
}

MomentJpeg MomentPainter::jpeg() { return {jpegOf(picture()), whyDark(isLit())}; }

}  // namespace afterglow::nodes
